# cmake -DPROGRAM=vkrun -DVERSION=0.1.0 -DOUT=vkrun.1 -P ManPage.cmake: what `vkrun --help` prints, as a manual page.
execute_process(COMMAND ${PROGRAM} --help OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE "\\" "\\e" text "${text}")
string(REPLACE "-" "\\-" text "${text}")
string(REGEX REPLACE "\n([.'])" "\n\\\\&\\1" text "${text}")
string(REGEX REPLACE "\n([A-Z][a-z ]+):\n" "\n.fi\n.SH \\1\n.nf\n" text "${text}")
string(REGEX REPLACE "^vkrun: ([^\n]*)\\.\n" "vkrun \\\\- \\1\n.SH DESCRIPTION\n.nf\n" text "${text}")
file(WRITE ${OUT} ".TH VKRUN 1 \"\" \"libsplat ${VERSION}\"\n.SH NAME\n${text}.fi\n")
