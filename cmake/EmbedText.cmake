# Run as a script: writes OUTPUT, a C++ source that defines `const char NAME[]` in namespace
# NAMESPACE with the content of INPUT. What the program needs in the field is inside it.
file(READ ${INPUT} content)
file(WRITE ${OUTPUT} "namespace ${NAMESPACE} {\nextern const char ${NAME}[];\nconst char ${NAME}[] = R\"EMBEDDED(${content})EMBEDDED\";\n}\n")
