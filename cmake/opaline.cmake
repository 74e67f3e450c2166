# What every directory uses: opaline_library(), opaline_program(), opaline_test(), opaline_shaders().

option(OPALINE_TESTS "Build the tests" ON)
option(OPALINE_BENCH "Build the benchmarks" OFF)
option(OPALINE_WERROR "A warning stops the build" OFF)
option(OPALINE_UNITY "Compile several sources of a library as one: quicker, and needs Python" OFF)
set(OPALINE_SANITIZE "" CACHE STRING "Sanitizers, for instance address,undefined or thread")

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
find_package(Threads REQUIRED)
find_program(OPALINE_CCACHE ccache)
if(OPALINE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${OPALINE_CCACHE})
  if(OPALINE_UNITY)  # what it asks for before it keeps what was compiled with precompiled headers
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${OPALINE_CCACHE})
  endif()
endif()

add_library(opaline_options INTERFACE)
target_include_directories(opaline_options INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(opaline_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
  -Wno-sign-conversion -Wnon-virtual-dtor -Woverloaded-virtual -ffp-contract=off)
if(OPALINE_WERROR)
  target_compile_options(opaline_options INTERFACE -Werror)
else()  # at -O3 and in instrumented code g++ 12 sees ghosts
  target_compile_options(opaline_options INTERFACE -Wno-maybe-uninitialized -Wno-restrict)
endif()
if(OPALINE_UNITY)  # of one source they say what is meant for another, or for headers
  target_compile_options(opaline_options INTERFACE -Wno-shadow -Wno-subobject-linkage)
endif()
if(OPALINE_SANITIZE)
  target_compile_options(opaline_options INTERFACE -fsanitize=${OPALINE_SANITIZE}
    -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(opaline_options INTERFACE -fsanitize=${OPALINE_SANITIZE})
endif()

# Sources that share no name of their own are compiled together: scripts/source_groups.py.
function(opaline_unite target)
  file(RELATIVE_PATH here ${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  list(TRANSFORM ARGN PREPEND ${here}/ OUTPUT_VARIABLE sources)
  execute_process(COMMAND python3 ${CMAKE_SOURCE_DIR}/scripts/source_groups.py ${sources}
    OUTPUT_VARIABLE lines COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE "\n" ";" lines "${lines}")
  set(number 0)
  foreach(line ${lines})
    string(REPLACE " " ";" group "${line}")
    list(TRANSFORM group PREPEND ${CMAKE_SOURCE_DIR}/)
    math(EXPR number "${number} + 1")
    set_source_files_properties(${group} PROPERTIES UNITY_GROUP group${number})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()

# opaline_library(NAME [APART] SOURCES a.cc ... USES lower_library ... LINK third::party ...)
# USES is the layer; tests/layering_test.cc holds it, and every #include, against the table of docs/architecture.md.
# LINK is private to the library; a third party that a header shows goes under PUBLIC_LINK. APART: never united, since programs
# that use one of its sources shall not link what another one needs (tests/linking_test.cc).
function(opaline_library name)
  cmake_parse_arguments(A "APART" "" "SOURCES;USES;LINK;PUBLIC_LINK" ${ARGN})
  add_library(opaline_${name} STATIC ${A_SOURCES})
  if(OPALINE_UNITY AND NOT A_APART)
    opaline_unite(opaline_${name} ${A_SOURCES})
  endif()
  list(TRANSFORM A_USES PREPEND opaline_)
  target_link_libraries(opaline_${name} PUBLIC opaline_options ${A_USES} ${A_PUBLIC_LINK} Threads::Threads
    PRIVATE ${A_LINK})
endfunction()

# opaline_program(opaline-capture SOURCES capture_main.cc USES capture base_images LINK CLI11::CLI11)
function(opaline_program name)
  cmake_parse_arguments(A "" "" "SOURCES;USES;LINK" ${ARGN})
  add_executable(${name} ${A_SOURCES})
  list(TRANSFORM A_USES PREPEND opaline_)
  target_link_libraries(${name} PRIVATE opaline_options ${A_USES} ${A_LINK} Threads::Threads)
endfunction()

# GoogleTest's headers are read once for all tests. Where a library's own macros forbid that, they are read again.
function(opaline_compile_test_quickly name)
  if(NOT TARGET opaline_test_headers)
    file(WRITE ${CMAKE_BINARY_DIR}/test_headers.cc "")
    add_library(opaline_test_headers OBJECT ${CMAKE_BINARY_DIR}/test_headers.cc)
    target_link_libraries(opaline_test_headers PRIVATE opaline_options GTest::gmock GTest::gtest Threads::Threads)
    target_compile_options(opaline_test_headers PRIVATE -O1 -Wno-error=invalid-pch -fpch-preprocess)
    target_precompile_headers(opaline_test_headers PRIVATE <gmock/gmock.h> <gtest/gtest.h>)
  endif()
  target_compile_options(${name} PRIVATE -O1 -Wno-error=invalid-pch -fpch-preprocess)
  target_precompile_headers(${name} REUSE_FROM opaline_test_headers)
endfunction()

# opaline_test(capture/bracket_test USES capture sim LABELS unit [LINK ...] [ENVIRONMENT A=b ...])
# builds tests/capture/bracket_test.cc with GoogleTest's main, one ctest entry for the file. Labels: unit needs
# nothing, threads is also run under TSan, conformance a driver, gpu a Vulkan device (a software one will do),
# api a daemon, slow is left out of sanitizer runs.
function(opaline_test path)
  cmake_parse_arguments(A "" "TIMEOUT" "USES;LABELS;LINK;ENVIRONMENT;SOURCES" ${ARGN})
  string(REPLACE "/" "." name ${path})
  add_executable(${name} ${CMAKE_SOURCE_DIR}/tests/${path}.cc ${A_SOURCES})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  list(TRANSFORM A_USES PREPEND opaline_)
  target_link_libraries(${name} PRIVATE opaline_options ${A_USES} ${A_LINK} GTest::gmock GTest::gtest_main)
  if(OPALINE_UNITY)  # a third quicker to compile, and what takes time to run is in the libraries
    opaline_compile_test_quickly(${name})
  endif()
  foreach(label ${A_LABELS})  # `ninja tests_unit` builds what carries the label
    if(NOT TARGET tests_${label})
      add_custom_target(tests_${label})
    endif()
    add_dependencies(tests_${label} ${name})
  endforeach()
  add_test(NAME ${name} COMMAND ${name})
  if(NOT A_TIMEOUT)
    set(A_TIMEOUT 300)
    if(OPALINE_SANITIZE)
      set(A_TIMEOUT 900)
    endif()
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "${A_LABELS}" TIMEOUT ${A_TIMEOUT}
    ENVIRONMENT "OPALINE_SOURCE_DIR=${CMAKE_SOURCE_DIR};OPALINE_CALIBRATIONS=${CMAKE_BINARY_DIR}/tests/no-calibrations;OPALINE_BIN_DIR=${CMAKE_BINARY_DIR}/bin;${A_ENVIRONMENT}")
endfunction()

# opaline_shaders(LIBRARY a.comp b.frag ...) compiles each to SPIR-V in the build tree and embeds it as
#   namespace opaline::shaders { extern const std::span<const std::uint32_t> a_comp; }   in "LIBRARY_shaders.h"
function(opaline_shaders library)
  find_program(GLSLANG glslangValidator REQUIRED)
  set(dir ${CMAKE_CURRENT_BINARY_DIR}/shaders)
  set(spvs)
  foreach(shader ${ARGN})
    get_filename_component(file ${shader} NAME)
    set(spv ${dir}/${file}.spv)
    add_custom_command(OUTPUT ${spv}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${dir}
      COMMAND ${GLSLANG} --quiet -V --target-env vulkan1.2 -I${CMAKE_CURRENT_SOURCE_DIR}/shaders --depfile ${spv}.d
        -o ${spv} ${CMAKE_CURRENT_SOURCE_DIR}/${shader}
      DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${shader} DEPFILE ${spv}.d VERBATIM)
    list(APPEND spvs ${spv})
  endforeach()
  add_custom_command(OUTPUT ${dir}/${library}_shaders.cc ${dir}/${library}_shaders.h
    COMMAND ${CMAKE_COMMAND} "-DFILES=${spvs}" -DOUTPUT=${dir}/${library}_shaders
      -P ${CMAKE_SOURCE_DIR}/cmake/embed_shaders.cmake
    DEPENDS ${spvs} ${CMAKE_SOURCE_DIR}/cmake/embed_shaders.cmake VERBATIM)
  # With a target of their own the files wait for no library that LIBRARY uses: scripts/check-tidy wants them without one.
  add_custom_target(${library}_shaders DEPENDS ${dir}/${library}_shaders.cc ${dir}/${library}_shaders.h)
  add_dependencies(opaline_${library} ${library}_shaders)
  target_sources(opaline_${library} PRIVATE ${dir}/${library}_shaders.cc ${dir}/${library}_shaders.h)
  target_include_directories(opaline_${library} PRIVATE ${dir})
endfunction()
