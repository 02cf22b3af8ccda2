# run(OUT WORDS...): runs a command, which must succeed, and sets OUT to what it printed.
function(run out)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT status EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}: status ${status}\n${text}")
  endif()
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

# expect(TEXT REGEX): fails unless the text matches.
function(expect text regex)
  if(NOT text MATCHES "${regex}")
    message(FATAL_ERROR "expected ${regex} in:\n${text}")
  endif()
endfunction()
