# Everything comes from Debian 12 (packages.txt). Libraries without a CMake package of their own
# are wrapped here as IMPORTED targets, so that their headers count as system headers.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED)
find_package(fcl REQUIRED)
find_package(CGAL REQUIRED)
find_package(assimp REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json 3 REQUIRED)
find_package(LibXml2 REQUIRED)
find_package(ZLIB REQUIRED)
# Optional, and only its headers: the library is loaded by its name when a GeoTIFF is read.
find_package(GDAL QUIET)
if(GDAL_FOUND)
  set(DIVE_GDAL_LIBRARY ${GDAL_LIBRARY})
  if(IS_SYMLINK ${GDAL_LIBRARY})  # libgdal.so -> libgdal.so.32
    file(READ_SYMLINK ${GDAL_LIBRARY} DIVE_GDAL_LIBRARY)
  endif()
endif()
if(DIVE_TESTS)
  find_package(GTest REQUIRED)
  find_package(rapidcheck REQUIRED)
  include(GoogleTest)
endif()
pkg_check_modules(CLI11 REQUIRED IMPORTED_TARGET CLI11)
if(DIVE_BENCH)
  find_package(benchmark REQUIRED)
endif()
find_program(LCM_GEN lcm-gen REQUIRED)

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Paths relative to the checkout, so that another clone of it finds the same objects; what
  # sloppiness names is what precompiled headers need.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${CMAKE_SOURCE_DIR}
      CCACHE_NOHASHDIR=1
      CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime ${CCACHE})
endif()

# fcl's exported target leaves its include directories non-system and drags octomap in.
set_target_properties(fcl PROPERTIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES
  "$<TARGET_PROPERTY:fcl,INTERFACE_INCLUDE_DIRECTORIES>")

add_library(dive_urdf_headers INTERFACE)
find_path(URDF_MODEL_INCLUDE urdf_model/model.h PATH_SUFFIXES urdfdom REQUIRED)
target_include_directories(dive_urdf_headers SYSTEM INTERFACE ${URDF_MODEL_INCLUDE})

add_library(dive_expected INTERFACE)
find_path(TL_EXPECTED_INCLUDE tl/expected.hpp REQUIRED)
target_include_directories(dive_expected SYSTEM INTERFACE ${TL_EXPECTED_INCLUDE})
# Installed with our libraries: cmake/DiveInstall.cmake.
set_property(GLOBAL APPEND PROPERTY DIVE_WRAPPED_LIBRARIES dive_urdf_headers dive_expected)

# Debian's pkg-config files of OMPL and LCM ask for packages that their libraries do not need
# (ode, glib's headers), so both are found by header and library.
function(dive_imported_library target header library)
  cmake_parse_arguments(LIB "" "" "SUFFIXES" ${ARGN})
  find_path(${target}_INCLUDE ${header} PATH_SUFFIXES ${LIB_SUFFIXES} REQUIRED)
  find_library(${target}_LIBRARY ${library} REQUIRED)
  add_library(${target} INTERFACE)
  target_include_directories(${target} SYSTEM INTERFACE ${${target}_INCLUDE})
  target_link_libraries(${target} INTERFACE ${${target}_LIBRARY})
  set_property(GLOBAL APPEND PROPERTY DIVE_WRAPPED_LIBRARIES ${target})
endfunction()
dive_imported_library(dive_ompl ompl/config.h ompl SUFFIXES ompl-1.5)
dive_imported_library(dive_lcm lcm/lcm.h lcm)
dive_imported_library(dive_sodium sodium.h sodium)
dive_imported_library(dive_sleef sleef.h sleef)
dive_imported_library(dive_geographiclib GeographicLib/LocalCartesian.hpp GeographicLib)
dive_imported_library(dive_systemd systemd/sd-daemon.h systemd)

# Of PCL only what is used: its CMake package would bring VTK, which takes longer to load than all
# the rest. Greedy projection is a template, compiled here.
dive_imported_library(dive_pcl_common pcl/point_types.h pcl_common SUFFIXES pcl-1.13)
dive_imported_library(dive_pcl_kdtree pcl/kdtree/kdtree_flann.h pcl_kdtree SUFFIXES pcl-1.13)
dive_imported_library(dive_pcl_search pcl/search/kdtree.h pcl_search SUFFIXES pcl-1.13)
dive_imported_library(dive_embree embree3/rtcore.h embree3)
dive_imported_library(dive_lzf liblzf/lzf.h lzf)

# Of ViSP and OpenCV too: find_package(VISP) would bring all modules of both.
dive_imported_library(dive_opencv_core opencv2/core.hpp opencv_core SUFFIXES opencv4)
dive_imported_library(dive_opencv_imgproc opencv2/imgproc.hpp opencv_imgproc SUFFIXES opencv4)
dive_imported_library(dive_opencv_imgcodecs opencv2/imgcodecs.hpp opencv_imgcodecs SUFFIXES opencv4)
dive_imported_library(dive_opencv_calib3d opencv2/calib3d.hpp opencv_calib3d SUFFIXES opencv4)
dive_imported_library(dive_opencv_features2d opencv2/features2d.hpp opencv_features2d SUFFIXES opencv4)
dive_imported_library(dive_opencv_video opencv2/video/tracking.hpp opencv_video SUFFIXES opencv4)
dive_imported_library(dive_visp_core visp3/core/vpConfig.h visp_core)
dive_imported_library(dive_visp_klt visp3/klt/vpKltOpencv.h visp_klt)
# Not ViSP's detector: see doc/decisions/tags-without-visp.md.
dive_imported_library(dive_apriltag apriltag/apriltag.h apriltag)
dive_imported_library(dive_png png.h png)
dive_imported_library(dive_yaml yaml-cpp/yaml.h yaml-cpp)
# Not OpenCV's imgcodecs: it brings GDAL (doc/decisions/gdal-when-needed.md).
dive_imported_library(dive_jpeg jpeglib.h jpeg)
dive_imported_library(dive_bz2 bzlib.h bz2)
dive_imported_library(dive_lz4 lz4frame.h lz4)
dive_imported_library(dive_zstd zstd.h zstd)
dive_imported_library(dive_sqlite sqlite3.h sqlite3)

# JavaScript that reports contain (dive_embed): the classic builds, which a page can contain as they
# are, and their licences. DIVE_REPORT_LIBRARIES is in the order of loading.
set(DIVE_REPORT_LIBRARIES)
foreach(name three.min.js examples/js/math/ConvexHull.js examples/js/controls/OrbitControls.js
        examples/js/lines/LineSegmentsGeometry.js examples/js/lines/LineMaterial.js
        examples/js/lines/LineSegments2.js)
  string(MAKE_C_IDENTIFIER DIVE_THREE_${name} file)
  find_file(${file} ${name} PATHS /usr/share/javascript/three REQUIRED NO_DEFAULT_PATH)
  list(APPEND DIVE_REPORT_LIBRARIES ${${file}})
endforeach()
find_file(DIVE_D3 d3.min.js PATHS /usr/share/nodejs/d3/dist REQUIRED NO_DEFAULT_PATH)
list(APPEND DIVE_REPORT_LIBRARIES ${DIVE_D3})
set(DIVE_REPORT_LICENCES /usr/share/doc/libjs-three/copyright /usr/share/doc/node-d3/copyright)
