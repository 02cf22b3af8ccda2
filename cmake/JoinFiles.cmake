# Run as a script: writes OUTPUT, the text files FILES (a list separated by commas) one after the
# other.
string(REPLACE "," ";" files "${FILES}")
file(WRITE ${OUTPUT} "")
foreach(name IN LISTS files)
  file(READ ${name} content)
  file(APPEND ${OUTPUT} "${content}\n")
endforeach()
