# SPDX-License-Identifier: Apache-2.0
"""Gradient-based navigation of a TurtleBot3 Burger, with smooth functions of its heading."""
