# dive_library(NAME SOURCES ... [USES ...] [LIBRARIES ...])
#
# One static library per module. USES names the libraries of ours that it depends on (public: their
# headers appear in its own); LIBRARIES names foreign libraries, which stay private to its .cpp files.
# A library that USES does not name is not linked, so a dependency in the wrong direction does not link.
#
# GCC 12 warns of members of an empty std::optional that it cannot prove empty: with and without
# reason alike, so that one stays a warning; of bounds that a std::string violates it warns without
# reason once its header is precompiled. The sanitizers find memory that is read unset or out of bounds.
# Clang, which builds the fuzz targets only, has other warnings, and so has GCC about code with
# sanitizers in it; they do not stop a build.
if(NOT DIVE_SANITIZE)
  set(DIVE_STOP_AT_WARNINGS $<$<CXX_COMPILER_ID:GNU>:-Werror>)
endif()
add_library(dive_flags INTERFACE)
target_compile_options(dive_flags INTERFACE -Wall -Wextra -Wconversion -Wshadow
                                            ${DIVE_STOP_AT_WARNINGS}
                                            $<$<CXX_COMPILER_ID:GNU>:-Wno-error=maybe-uninitialized>
                                            $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>
                                            $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict> -ffp-contract=off)
# Most of the time to compile a source goes into templates that its neighbours use too, so the
# presets release and asan compile ten at a time, in a third of the time: names in unnamed namespaces must
# differ within a library. The preset dev compiles each source by itself, and finds a missing include.
if(CMAKE_UNITY_BUILD)
  target_compile_options(dive_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endif()
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
  target_compile_options(dive_flags INTERFACE -include ${CMAKE_SOURCE_DIR}/cmake/unfused_neon.h)
endif()
if(DIVE_SANITIZE)
  # Checks of null and alignment double the time to compile; a null pointer stops the address
  # sanitizer anyway.
  add_compile_options(-fsanitize=${DIVE_SANITIZE} -fno-sanitize=null,alignment
                      -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_compile_definitions(_GLIBCXX_ASSERTIONS)
  add_link_options(-fsanitize=${DIVE_SANITIZE})
endif()

# Two thirds of the time to compile a file goes into reading Eigen, fmt and the standard library (of a
# test: GoogleMock; of a study: CLI11), so these are read once for each kind of program. A source
# still includes what it uses: -DDIVE_PRECOMPILE=OFF builds without.
option(DIVE_PRECOMPILE "Precompile the headers that most sources include" ON)
function(dive_precompile name)
  file(CONFIGURE OUTPUT ${name}.cpp CONTENT "")
  add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE Eigen3::Eigen fmt::fmt dive_flags)
  target_precompile_headers(${name} PRIVATE ${ARGN})
  # The compiler cache needs the names of the headers in the preprocessed source.
  target_compile_options(${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)
endfunction()
set(DIVE_PRECOMPILED_HEADERS <Eigen/Cholesky> <Eigen/Core> <Eigen/Geometry> <Eigen/LU> <algorithm>
    <chrono> <filesystem> <fmt/format.h> <functional> <map> <memory> <optional> <set> <span> <string>
    <tl/expected.hpp> <variant> <vector>)
if(DIVE_PRECOMPILE)
  dive_precompile(dive_precompiled ${DIVE_PRECOMPILED_HEADERS})
  if(DIVE_TESTS)
    dive_precompile(dive_precompiled_tests ${DIVE_PRECOMPILED_HEADERS} <fstream> <gmock/gmock.h> <gtest/gtest.h>)
    target_compile_options(dive_precompiled_tests PRIVATE $<$<CONFIG:Release>:-O1>)
    target_link_libraries(dive_precompiled_tests PRIVATE GTest::gmock)
  endif()
  if(DIVE_BENCH)
    dive_precompile(dive_precompiled_studies ${DIVE_PRECOMPILED_HEADERS} <CLI/CLI.hpp>)
    target_link_libraries(dive_precompiled_studies PRIVATE PkgConfig::CLI11)
  endif()
endif()
function(dive_use_precompiled name headers)
  if(DIVE_PRECOMPILE)
    target_precompile_headers(${name} REUSE_FROM ${headers})
    target_compile_options(${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)
  endif()
endfunction()

function(dive_library name)
  cmake_parse_arguments(LIBRARY "" "" "SOURCES;USES;LIBRARIES" ${ARGN})
  add_library(${name} STATIC ${LIBRARY_SOURCES})
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}>
                                            $<INSTALL_INTERFACE:include/dive>)
  target_compile_features(${name} INTERFACE $<INSTALL_INTERFACE:cxx_std_20>)
  target_link_libraries(${name} PUBLIC Eigen3::Eigen ${LIBRARY_USES}
                                PRIVATE $<BUILD_INTERFACE:dive_flags> fmt::fmt ${LIBRARY_LIBRARIES})
  set_property(GLOBAL APPEND PROPERTY DIVE_LIBRARIES ${name})
  dive_use_precompiled(${name} dive_precompiled)
endfunction()

# dive_test(NAME [REAL_TIME] [SANITIZED] [SEPARATE] SOURCES ... USES ... [LIBRARIES ...]): one GoogleTest
# program per module; REAL_TIME where its tests run in real time: they begin first, and one at a time;
# SANITIZED where CI runs it under the sanitizers too, because what it tests reads what others wrote (CI
# has not the time for all); SEPARATE where its sources use the same names in unnamed
# namespaces, so that each is compiled by itself.
add_custom_target(tests)
add_custom_target(sanitized_tests)
function(dive_test name)
  cmake_parse_arguments(TEST "REAL_TIME;SANITIZED;SEPARATE" "" "SOURCES;USES;LIBRARIES" ${ARGN})
  add_executable(${name} ${TEST_SOURCES})
  if(TEST_SEPARATE)
    set_target_properties(${name} PROPERTIES UNITY_BUILD OFF)
  endif()
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
  target_compile_definitions(${name} PRIVATE DIVE_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
                                             DIVE_SHARED_DATA="${DIVE_SHARED_DATA}")
  # What is tested is in the libraries; the test programs themselves need not be fast.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  target_link_libraries(${name} PRIVATE ${TEST_USES} ${TEST_LIBRARIES} dive_flags fmt::fmt
                                        GTest::gmock GTest::gtest_main rapidcheck)
  dive_use_precompiled(${name} dive_precompiled_tests)
  add_dependencies(tests ${name})
  set(properties)
  if(TEST_REAL_TIME)
    set(properties RESOURCE_LOCK real_time COST 1000)
  endif()
  if(TEST_SANITIZED)
    add_dependencies(sanitized_tests ${name})
    list(APPEND properties LABELS sanitized)
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 NO_PRETTY_VALUES
                       PROPERTIES TIMEOUT 1800 ${properties})
endfunction()

# dive_bench(NAME SOURCES ... USES ...): one Google Benchmark program.
function(dive_bench name)
  cmake_parse_arguments(BENCH "" "" "SOURCES;USES;LIBRARIES" ${ARGN})
  add_executable(${name} ${BENCH_SOURCES})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
  target_compile_definitions(${name} PRIVATE DIVE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  target_link_libraries(${name} PRIVATE ${BENCH_USES} ${BENCH_LIBRARIES} dive_flags fmt::fmt
                                        benchmark::benchmark benchmark::benchmark_main)
  dive_use_precompiled(${name} dive_precompiled)
endfunction()

# dive_study(NAME SOURCES ... USES ... [LIBRARIES ...]): a program that measures and prints a report.
function(dive_study name)
  cmake_parse_arguments(STUDY "" "" "SOURCES;USES;LIBRARIES" ${ARGN})
  add_executable(${name} ${STUDY_SOURCES})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
  target_compile_definitions(${name} PRIVATE DIVE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  target_link_libraries(${name} PRIVATE ${STUDY_USES} ${STUDY_LIBRARIES} dive_flags
                                        PkgConfig::CLI11 fmt::fmt)
  dive_use_precompiled(${name} dive_precompiled_studies)
endfunction()

# dive_stalls_disk(NAME): the program can stall the disk of the processes that it starts.
function(dive_stalls_disk name)
  if(NOT TARGET stalled_disk)
    add_library(stalled_disk MODULE ${CMAKE_SOURCE_DIR}/test/mission/link/stalled_disk.cpp)
    target_link_libraries(stalled_disk PRIVATE dive_flags)
  endif()
  target_compile_definitions(${name} PRIVATE STALLED_DISK="$<TARGET_FILE:stalled_disk>")
  add_dependencies(${name} stalled_disk)
endfunction()

# dive_embed(TARGET INPUT NAMESPACE NAME): compiles a text file into TARGET as a string constant.
function(dive_embed target input namespace name)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DINPUT=${input} -DOUTPUT=${output} -DNAMESPACE=${namespace}
            -DNAME=${name} -P ${CMAKE_SOURCE_DIR}/cmake/EmbedText.cmake
    DEPENDS ${input} ${CMAKE_SOURCE_DIR}/cmake/EmbedText.cmake VERBATIM)
  target_sources(${target} PRIVATE ${output})
  set_source_files_properties(${output} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# dive_join_files(OUTPUT FILES...): one text file after the other.
function(dive_join_files output)
  string(REPLACE ";" "," files "${ARGN}")
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DFILES=${files} -DOUTPUT=${output}
            -P ${CMAKE_SOURCE_DIR}/cmake/JoinFiles.cmake
    DEPENDS ${ARGN} ${CMAKE_SOURCE_DIR}/cmake/JoinFiles.cmake VERBATIM)
endfunction()

# dive_bundle_modules(OUTPUT MODULES...): joins ES modules into one script.
function(dive_bundle_modules output)
  string(REPLACE ";" "," modules "${ARGN}")
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DMODULES=${modules} -DOUTPUT=${output}
            -P ${CMAKE_SOURCE_DIR}/cmake/BundleModules.cmake
    DEPENDS ${ARGN} ${CMAKE_SOURCE_DIR}/cmake/BundleModules.cmake VERBATIM)
endfunction()
