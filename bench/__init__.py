# SPDX-License-Identifier: Apache-2.0
"""Benchmarks; no part of the package. See README.md here."""
