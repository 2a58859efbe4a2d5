# cmake -DPROGRAM=<raster_hashes> -DRUNS=<n> -DTHREADS=<a,b,...> -DVALIDATION=<0,1> -P reproducible.cmake
# The results are the same bits for every number of runs and driver threads, with and without the
# validation layer.
string(REPLACE "," ";" threads_list "${THREADS}")
string(REPLACE "," ";" validation_list "${VALIDATION}")
set(first "")
foreach(validation IN LISTS validation_list)
  foreach(threads IN LISTS threads_list)
    execute_process(COMMAND ${CMAKE_COMMAND} -E env LP_NUM_THREADS=${threads}
                            SPLAT_TEST_VALIDATION=${validation} ${PROGRAM} ${RUNS}
                    OUTPUT_VARIABLE hashes RESULT_VARIABLE failed)
    set(what "LP_NUM_THREADS=${threads}, validation ${validation}")
    if(failed)
      message(FATAL_ERROR "${what}: ${failed}\n${hashes}")
    endif()
    if(first STREQUAL "")
      set(first "${hashes}")
      message("${hashes}")
    elseif(NOT first STREQUAL hashes)
      message(FATAL_ERROR "${what} gives other bits:\n${hashes}")
    endif()
  endforeach()
endforeach()
if(first STREQUAL "")
  message(FATAL_ERROR "no hashes were printed")
endif()
