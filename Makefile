# SPDX-License-Identifier: Apache-2.0
# Needs Python 3.11 or 3.12 and a package registry; everything else goes into .venv on first use.

PYTHON ?= python3
BIN := .venv/bin

.PHONY: demo test test-long soak lint bench clean

demo: .venv/ready
	$(BIN)/gradnav demo --out out/demo

test: .venv/ready
	$(BIN)/pytest --numprocesses 3 --dist loadfile

test-long: .venv/ready
	GRADNAV_WORLDS=200 GRADNAV_ROOMS=100 GRADNAV_POSE_SEEDS=10 GRADNAV_SCANS=200 \
		GRADNAV_CROSSINGS=100 $(BIN)/pytest --timeout 3000 \
		test/test_check.py test/test_shapes.py test/test_pose_goal.py test/test_scan.py
	GRADNAV_MESSAGES=1000000 GRADNAV_MUTATIONS=5000 GRADNAV_STARTS=100 \
		$(BIN)/pytest --timeout 3000 \
		test/test_faults_messages.py test/test_faults_files.py test/test_mismatch.py

soak: .venv/ready  # eight hours of the robot's time in twenty-four minutes
	GRADNAV_SOAK_HOURS=8 $(BIN)/pytest --timeout 3600 test/test_soak.py

lint: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: .venv/bench
	$(BIN)/python -m bench

.venv/bench: .venv/ready
	$(BIN)/pip install --quiet --editable '.[bench]'
	touch $@

.venv/ready: setup.py
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed: make PYTHON=python3.11")'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --editable '.[all,test,lint]'
	$(BIN)/pip install --quiet --editable '.[map]' || echo 'potential map and its tests are left out: scikit-fmm needs a C++ compiler'
	touch $@

clean:
	rm -rf .venv build install log out *.egg-info
