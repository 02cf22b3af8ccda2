# Run as a script: writes OUTPUT, one script without imports, from the ES modules MODULES (a list
# separated by commas, each after those it imports). The modules share one scope, so that a name may
# be defined by one of them only; an import may not rename.
string(REPLACE "," ";" modules "${MODULES}")
file(WRITE ${OUTPUT} "'use strict';\n(() => {\n")
foreach(module IN LISTS modules)
  file(READ ${module} content)
  string(REGEX REPLACE "(^|\n)import [^;]*;" "\\1" content "${content}")
  string(REGEX REPLACE "(^|\n)export " "\\1" content "${content}")
  file(APPEND ${OUTPUT} "${content}")
endforeach()
file(APPEND ${OUTPUT} "})();\n")
