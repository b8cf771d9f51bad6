"""Runs one file of tests; exit code 77, which ctest shows as skipped, where pytest is not there or all tests were skipped."""
import sys


class Count:
    def __init__(self):
        self.skipped = self.others = 0

    def pytest_runtest_logreport(self, report):
        self.skipped += report.skipped
        self.others += report.when == "call" and not report.skipped or report.failed

    def pytest_collectreport(self, report):
        self.skipped += report.skipped


def main():
    try:
        import pytest
    except ImportError:
        print("pytest is not here: nothing is tested")
        return 77
    count = Count()
    status = pytest.main(["-q", "-rs", "-p", "no:cacheprovider", *sys.argv[1:]], plugins=[count])
    return 77 if count.skipped and not count.others and status in (0, 5) else status


if __name__ == "__main__":  # processes that tests start by "spawn" import this file
    sys.exit(main())
