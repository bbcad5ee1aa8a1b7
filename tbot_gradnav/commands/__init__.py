# SPDX-License-Identifier: Apache-2.0
"""The subcommands of gradnav: each has add_arguments(parser) and run(options) -> exit status."""
