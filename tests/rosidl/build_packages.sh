#!/bin/sh -eu
# Our message packages with colcon and ROS 2's wheels: build_packages.sh VENV FOLDER, which has them in FOLDER/src.
venv=$(cd "$1" && pwd)
cd "$2"
PATH=$venv/bin:$PATH AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv LD_LIBRARY_PATH=$venv/lib \
    colcon build --base-paths src --cmake-args -DBUILD_TESTING=OFF
