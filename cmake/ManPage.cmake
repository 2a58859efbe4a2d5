# cmake -DPROGRAM=vkrun -DVERSION=0.1.0 -DOUT=<folder> -P ManPage.cmake
#
# Writes the manual pages <folder>/man/vkrun.1 and, for each command, vkrun-<command>.1, of what `--help` prints; and
# the files of completion <folder>/completion/vkrun.bash, _vkrun and vkrun.fish.

# help(<result> <word of the command line>...): what `--help` prints, for troff.
function(help result)
  execute_process(COMMAND ${PROGRAM} ${ARGN} --help OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE "\\" "\\e" text "${text}")
  string(REPLACE "-" "\\-" text "${text}")
  string(REGEX REPLACE "\n([.'])" "\n\\\\&\\1" text "${text}")
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

# commands(<result> <word of the command line>...): the names of the commands below.
function(commands result)
  execute_process(COMMAND ${PROGRAM} --complete ${ARGN} "" OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "(^|\n)[a-z][a-z0-9-]*\t" names "${text}")
  list(TRANSFORM names REPLACE "[\n\t]" "")
  set(${result} "${names}" PARENT_SCOPE)
endfunction()

# page(<name> <text>): the first sentence is the page's summary, and sections are those of the help.
function(page name text)
  string(REGEX REPLACE "\n([A-Z][a-z ]+):\n" "\n.fi\n.SH \\1\n.nf\n" text "${text}")
  string(TOUPPER "${name}" title)
  file(WRITE ${OUT}/man/${name}.1 ".TH ${title} 1 \"\" \"libsplat ${VERSION}\"\n.SH NAME\n${text}.fi\n")
endfunction()

file(REMOVE_RECURSE ${OUT}/man ${OUT}/completion)
help(text)
string(REGEX REPLACE "^vkrun: ([^\n]*)\\.\n" "vkrun \\\\- \\1\n.SH DESCRIPTION\n.nf\n" text "${text}")
page(vkrun "${text}")
commands(all)
foreach(command IN LISTS all)
  help(text ${command})
  string(REGEX REPLACE "^([^\n]*)\\.\n" "vkrun\\\\-${command} \\\\- \\1\n.SH DESCRIPTION\n.nf\n" text "${text}")
  commands(below ${command})
  if(NOT text MATCHES "\nCommands:\n")  # then what stands at the cursor is an argument's value
    set(below "")
  endif()
  foreach(name IN LISTS below)
    help(more ${command} ${name})
    string(TOUPPER "vkrun ${command} ${name}" title)
    string(REGEX REPLACE "\n([A-Z][a-z ]+:\n)" "\n.fi\n.SS \\1.nf\n" more "${more}")
    string(APPEND text ".fi\n.SH ${title}\n.nf\n${more}")
  endforeach()
  page(vkrun-${command} "${text}")
endforeach()

file(MAKE_DIRECTORY ${OUT}/completion)
foreach(pair IN ITEMS "bash;vkrun.bash" "zsh;_vkrun" "fish;vkrun.fish")
  list(POP_FRONT pair shell)
  execute_process(COMMAND ${PROGRAM} completion ${shell} OUTPUT_FILE ${OUT}/completion/${pair}
                  COMMAND_ERROR_IS_FATAL ANY)
endforeach()
