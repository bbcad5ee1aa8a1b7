# SPDX-License-Identifier: Apache-2.0
"""What a user can get wrong, said in one line."""


class GradnavError(Exception):
    """Root of every error that is the user's to mend; its text is one line."""

    def __init__(self, text: str) -> None:
        super().__init__(" ".join(text.split()))


class ParameterError(GradnavError):
    """A parameter has a value that is not allowed.

    `name` is the parameter's dotted name, `value` what was given and `allowed` what may be given.
    """

    def __init__(self, name: str, value: object, allowed: str) -> None:
        super().__init__(f"{name}: {_short(value)} is not allowed; {allowed}")
        self.name = name
        self.value = value
        self.allowed = allowed

    def within(self, prefix: str) -> "ParameterError":
        """Return the same complaint about `prefix` + name."""
        return ParameterError(prefix + self.name, self.value, self.allowed)


def _short(value: object) -> str:
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # Python refuses to print integers of thousands of digits
        return "a number too long to print"
    return text if len(text) <= 60 else text[:57] + "..."
