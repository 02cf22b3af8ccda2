# The units: systemd reads them without a complaint, and finds them sandboxed.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
set(units ${SOURCE}/packaging/systemd/dive-run.service ${SOURCE}/packaging/systemd/dive-supervise.service)
find_program(analyze systemd-analyze)
if(NOT analyze)
  message("skipped: systemd-analyze is not installed")
  return()
endif()

# `verify` needs the commands that the units start.
set(place ${BUILD}/test-packaging/systemd)
file(REMOVE_RECURSE ${place})
foreach(unit IN LISTS units)
  file(READ ${unit} text)
  string(REPLACE "ExecStart=dive " "ExecStart=${BUILD}/dive " text "${text}")
  get_filename_component(name ${unit} NAME)
  file(WRITE ${place}/${name} "${text}")
  run(text ${analyze} verify --man=no ${place}/${name})
  # What it says of other units of the machine does not concern us.
  string(REGEX MATCH "[^\n]*dive-[a-z]+\\.service[^\n]*" complaint "${text}")
  if(complaint)
    message(FATAL_ERROR "${complaint}")
  endif()
  run(text ${analyze} security --offline=yes --threshold=25 ${place}/${name})
endforeach()

file(READ ${SOURCE}/packaging/systemd/dive-run.service text)
foreach(line Type=notify WatchdogSec=3 TimeoutStopSec=infinity Restart=on-failure SuccessExitStatus=1
        LimitRTPRIO=50)
  expect("${text}" "\n${line}\n")
endforeach()
# The control loop runs at real-time priority.
if(text MATCHES "\nRestrictRealtime=(yes|true|1)")
  message(FATAL_ERROR "RestrictRealtime would refuse LimitRTPRIO")
endif()

# A start without a journal, and one that continues: what the shell of the unit runs.
file(WRITE ${place}/bin/dive "#!/bin/sh\necho \"$@\"\n")
file(CHMOD ${place}/bin/dive PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
string(REGEX MATCH "ExecStart=sh -c '([^']*)'" start "${text}")
string(REPLACE "$$" "$" script "${CMAKE_MATCH_1}")
string(REPLACE "%%" "%" script "${script}")
string(REPLACE "\\\n" " " script "${script}")
set(ENV{PATH} "${place}/bin:$ENV{PATH}")
set(ENV{DIVE_LCM} "udpm://239.255.76.67:7667?ttl=1")
set(ENV{DIVE_RUN_OPTIONS} "--stats --cameras cameras")
file(WRITE ${place}/start.sh "${script}\n")
set(here ${CMAKE_COMMAND} -E chdir ${place} sh start.sh)

run(first ${here})
expect("${first}" "^run mission.xml --key dive.key --lcm udpm://239.255.76.67:7667\\?ttl=1 --log [0-9]+.lcmlog --journal dive.journal --stats --cameras cameras\n$")
file(WRITE ${place}/dive.journal "content")
run(again ${here})
expect("${again}" "--cameras cameras --resume\n$")
# A bundle is dived rather than the mission beside it.
file(WRITE ${place}/mission.bundle "content")
run(bundle ${here})
expect("${bundle}" "^run mission.bundle --key dive.key ")
