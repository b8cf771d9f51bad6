"""Joins JUnit files of Node and pytest into one in the way of CTest, whose cases say their status: join_results.py OUT IN..."""
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

out, *parts = sys.argv[1:]
suite = ElementTree.Element("testsuite", name="web")
for part in parts:
    # A run that ended before it wrote its file has failed.
    if not Path(part).exists():
        ElementTree.SubElement(suite, "testcase", name=part, status="fail")
        continue
    for case in ElementTree.parse(part).getroot().iter("testcase"):
        failed = case.find("failure") is not None or case.find("error") is not None
        case.set("status", "fail" if failed else "notrun" if case.find("skipped") is not None else "run")
        suite.append(case)
cases = suite.findall("testcase")
for kind, statuses in (("tests", ("run", "fail", "notrun")), ("failures", ("fail",)), ("skipped", ("notrun",))):
    suite.set(kind, str(sum(case.get("status") in statuses for case in cases)))
ElementTree.ElementTree(suite).write(out, encoding="utf-8", xml_declaration=True)
for case in cases:
    if case.get("status") != "run":
        print(f"{case.get('status')}: {case.get('name')}")
print(f"{len(cases)} tests of the web: {suite.get('failures')} failed, {suite.get('skipped')} skipped")
sys.exit(0 if cases and suite.get("failures") == "0" else 1)
