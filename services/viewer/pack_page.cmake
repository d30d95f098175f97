# Packs the page's files and three.js into the folder that chase-viewer serves. Foxglove's layout stays as it is: who fetches it
# may not take gzip.
# Usage: cmake -DPAGE=page -DTHREE=node_modules/three -DTO=folder -P pack_page.cmake
file(REMOVE_RECURSE ${TO}.new)
file(MAKE_DIRECTORY ${TO}.new)
file(GLOB files ${PAGE}/*)
if(EXISTS ${THREE}/build/three.module.min.js)
  list(APPEND files ${THREE}/build/three.module.min.js ${THREE}/build/three.core.min.js)
  # Its import has to name a file: the page needs no import map then.
  file(READ ${THREE}/examples/jsm/controls/OrbitControls.js text)
  string(REPLACE "from 'three'" "from './three.module.min.js'" text "${text}")
  file(WRITE ${TO}.new/OrbitControls.js "${text}")
endif()
file(COPY ${files} DESTINATION ${TO}.new)
file(GLOB copies ${TO}.new/*)
list(FILTER copies EXCLUDE REGEX "\\.json$")
execute_process(COMMAND gzip -9 -n ${copies} COMMAND_ERROR_IS_FATAL ANY)
file(REMOVE_RECURSE ${TO})
file(RENAME ${TO}.new ${TO})
