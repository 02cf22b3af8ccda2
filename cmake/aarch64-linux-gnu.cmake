# Toolchain for a cross build with Debian's g++-aarch64-linux-gnu. The environment variable
# DIVE_SYSROOT names a folder into which the arm64 packages of packages.txt are unpacked.
if("$ENV{DIVE_SYSROOT}" STREQUAL "" OR NOT IS_DIRECTORY "$ENV{DIVE_SYSROOT}/usr/include")
  message(FATAL_ERROR "DIVE_SYSROOT must name a folder with unpacked arm64 packages")
endif()
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_SYSROOT $ENV{DIVE_SYSROOT})
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_CROSSCOMPILING_EMULATOR "qemu-aarch64;-L;$ENV{DIVE_SYSROOT}")
set(ENV{PKG_CONFIG_SYSROOT_DIR} $ENV{DIVE_SYSROOT})
set(ENV{PKG_CONFIG_LIBDIR}
    $ENV{DIVE_SYSROOT}/usr/lib/aarch64-linux-gnu/pkgconfig:$ENV{DIVE_SYSROOT}/usr/share/pkgconfig)
