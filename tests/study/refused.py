import pytest

from nsdrill.errors import Fault, StudyError
from nsdrill.study import parse_study


def faults(text: str, *overrides: str) -> list[Fault]:
    """What is said of a study that is refused."""
    with pytest.raises(StudyError) as caught:
        parse_study(text, "s.yaml", overrides)
    return caught.value.faults
