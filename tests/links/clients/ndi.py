"""Tracks the first tool with ndicapi and prints its position in mm, by text and by bytes."""
import sys

import ndicapy as ndi

device = ndi.ndiOpenNetwork("127.0.0.1", int(sys.argv[1]))
assert device, "no connection"


def send(command):
    answer = ndi.ndiCommand(device, command)
    assert ndi.ndiGetError(device) == 0, (command, answer)
    return answer


send("INIT:")
send("APIREV:")
handle = send("PHSR:02")[2:4]
send(f"PINIT:{handle}")
send(f"PENA:{handle}D")
send("TSTART:")
tool = bytes([int(handle, 16)])
send("TX:0001")
text = ndi.ndiGetTXTransform(device, tool)
send("BX:0001")
binary = ndi.ndiGetBXTransform(device, tool)
send("TSTOP:")
print(*text[4:7], *binary[4:7])
ndi.ndiClose(device)
