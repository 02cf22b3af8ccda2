# The examples, built against an installed tree and run.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
set(place ${BUILD}/test-packaging/examples)
file(REMOVE_RECURSE ${place})
run(installed ${CMAKE_COMMAND} --install ${BUILD} --prefix ${place}/installed)

# Nothing of the installation may refer to the tree that it was built in.
file(GLOB configs ${place}/installed/lib/cmake/dive/*.cmake)
foreach(config IN LISTS configs)
  file(READ ${config} text)
  foreach(tree ${SOURCE} ${BUILD})
    string(FIND "${text}" "${tree}/" at)
    if(NOT at EQUAL -1)
      message(FATAL_ERROR "${config} refers to ${tree}")
    endif()
  endforeach()
endforeach()

function(build_example name)
  run(text ${CMAKE_COMMAND} -S ${SOURCE}/examples/${name} -B ${place}/${name} -G Ninja
      -DCMAKE_PREFIX_PATH=${place}/installed -DCMAKE_BUILD_TYPE=Release)
  run(text ${CMAKE_COMMAND} --build ${place}/${name} -j 1)
endfunction()

build_example(plan-a-path)
run(text ${place}/plan-a-path/plan_a_path ${SOURCE}/missions/maps/window.sdf)
expect("${text}" "success: 1[0-9]\\.[0-9] m, clearance (0\\.[6-9]|1\\.)")

build_example(custom-behavior)
run(text ${place}/custom-behavior/look_around ${SOURCE}/examples/custom-behavior/look.xml)
expect("${text}" "^success, turned by 3[4-7][0-9] degrees")

# The installed command finds what it needs without the tree it was built in.
run(text ${place}/installed/bin/dive check --static ${place}/installed/share/dive/missions/window.xml)
expect("${text}" "window.xml: ok")
foreach(file share/man/man1/dive-check.1.gz share/bash-completion/completions/dive
        share/zsh/vendor-completions/_dive lib/systemd/system/dive-run.service)
  if(NOT EXISTS ${place}/installed/${file})
    message(FATAL_ERROR "${file} is not installed")
  endif()
endforeach()
