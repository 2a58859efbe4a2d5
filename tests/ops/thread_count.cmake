# cmake -DPROGRAM=<op_hashes> -P thread_count.cmake: the results do not depend on the number of
# driver threads.
set(first "")
foreach(threads IN ITEMS 0 1 2 4)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env LP_NUM_THREADS=${threads} ${PROGRAM}
                  OUTPUT_VARIABLE hashes RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "LP_NUM_THREADS=${threads}: ${failed}\n${hashes}")
  endif()
  if(first STREQUAL "")
    set(first "${hashes}")
    message("${hashes}")
  elseif(NOT first STREQUAL hashes)
    message(FATAL_ERROR "LP_NUM_THREADS=${threads} gives other bits:\n${hashes}")
  endif()
endforeach()
if(first STREQUAL "")
  message(FATAL_ERROR "no hashes were printed")
endif()
