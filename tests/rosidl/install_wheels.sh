#!/bin/sh -eu
# ROS 2 Jazzy's wheels into a virtual environment of their own: install_wheels.sh VENV [PYTHON]
venv=$1
"${2:-python3}" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11) or sys.platform != "linux")' || {
    echo "ROS 2's wheels are for Python 3.11 on Linux: give one, as in make ros2-packages PYTHON=python3.11" >&2
    exit 2
}
"${2:-python3}" -m venv --clear "$venv"
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check -r "$(dirname "$0")/wheels.txt"
# The CMake files in them name the headers of the machine on which they were made.
headers=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
arrays=$("$venv/bin/python" -c 'import numpy; print(numpy.get_include())')
grep -rl /opt/python/cp311-cp311 "$venv/share" --include='*.cmake' | while read -r file; do
    sed -i "s#/opt/python/cp311-cp311/include/python3.11#$headers#g
            s#/opt/python/cp311-cp311/lib/python3.11/site-packages/numpy/_core/include#$arrays#g" "$file"
done
