# Compiler settings shared by every target, and shaped_library(): one layer of the architecture.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_C_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()

find_program(MOLD_PROGRAM mold)
if(MOLD_PROGRAM)
  add_link_options(-fuse-ld=mold)
endif()

if(SHAPED_ARCHITECTURE)
  add_compile_options(-march=${SHAPED_ARCHITECTURE})
endif()
if(SHAPED_SANITIZE)
  add_compile_options(-fsanitize=${SHAPED_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${SHAPED_SANITIZE})
endif()
if(SHAPED_FUZZ)
  # Whatever a sanitizer or an assertion of the standard library sees ends the program: that is how libFuzzer notices.
  add_compile_options(-fno-sanitize-recover=all)
  add_compile_definitions(_GLIBCXX_ASSERTIONS)
endif()

# Ceres drags ATLAS onto the link line, which would then serve CHOLMOD's dgemm at less than half the speed.
add_link_options("LINKER:--push-state,--no-as-needed,-lopenblas,--pop-state")

# GCC 12 sees overlapping copies in "literal" + std::string (its bug 105651).
set(SHAPED_WARNINGS -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  list(APPEND SHAPED_WARNINGS -Wno-restrict)
endif()
if(SHAPED_SANITIZE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Its instrumentation hides initialisations from this warning, which then fires in OpenMesh and the standard library.
  list(APPEND SHAPED_WARNINGS -Wno-maybe-uninitialized)
endif()

# shaped_library(NAME LINKS...): the library target NAME of all .cpp files in the current folder, linking only what it names.
function(shaped_library name)
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  add_library(${name} STATIC ${sources})
  target_compile_options(${name} PRIVATE ${SHAPED_WARNINGS})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC ${ARGN})
endfunction()
