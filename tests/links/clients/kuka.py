"""Reads the joint values of a KUKA controller with py_openshowvar and prints them in degree."""
import re
import sys

from py_openshowvar import openshowvar

controller = openshowvar("127.0.0.1", int(sys.argv[1]))
assert controller.read("$NO_SUCH_VARIABLE", False) is None
assert controller.write("$OV_PRO", "50", False) is None, "a simulated controller is never written"
value = controller.read("$AXIS_ACT", False).decode()
print(*re.findall(r"\bA\d ([-0-9.]+)", value))
controller.close()
