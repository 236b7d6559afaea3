# make demo: install and run the main job.  make test: install and check everything.
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

# ROS 1 as Debian and Ubuntu package it; the environment takes only these from the distribution
# (defras_bt/dvrk/ros_packages.py).
ROS_PACKAGES := python3-rospy python3-roslaunch python3-geometry-msgs python3-sensor-msgs python3-std-msgs

.PHONY: demo test check setup ros clean

demo: $(READY)
	$(BIN)/defras run sim/scenes/demo.yaml --actual sim/scenes/demo_actual.yaml --world bullet --seed 1 --out out/demo --replace

test: $(READY) ros check
	$(BIN)/pytest -n 2 --dist worksteal tests

check: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

setup: $(READY)

$(READY): pyproject.toml constraints.txt
	@command -v $(PYTHON) >/dev/null || { echo "Python 3.11 is needed: apt-get install python3.11 python3.11-venv"; exit 2; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt torch==2.13.0
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test]'
	touch $(READY)

# The stand-in of the dVRK is tested over a real ROS 1 master, which is installed where it is missing.
ros:
	@if command -v roscore >/dev/null || dpkg -s $(ROS_PACKAGES) >/dev/null 2>&1; then exit 0; fi; \
	command -v apt-get >/dev/null || { echo "The tests of the dVRK need ROS 1 (roscore and rospy), which is not installed, and there is no apt-get to install it. On Debian 12: apt-get install $(ROS_PACKAGES). Without it: make check; $(BIN)/pytest tests (tests that need ROS say so and are skipped)."; exit 2; }; \
	if [ "$$(id -u)" = 0 ]; then as_root=; elif command -v sudo >/dev/null; then as_root=sudo; else echo "ROS 1 is missing and only root can install it: apt-get install $(ROS_PACKAGES)"; exit 2; fi; \
	$$as_root apt-get update -q && \
	$$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $(ROS_PACKAGES)

clean:
	rm -rf $(VENV) out
