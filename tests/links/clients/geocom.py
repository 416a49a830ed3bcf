"""Measures one point with geocompy, with checksums, and prints east, north and height in mm."""
import sys

from geocompy.communication import open_socket
from geocompy.geo import GeoCom

with open_socket("127.0.0.1", int(sys.argv[1]), "tcp") as line:
    station = GeoCom(line, checksum=True)
    for answer in (
        station.csv.get_instrument_name(),
        station.csv.get_serial_number(),
        station.tmc.get_prism_correction(),
        station.tmc.get_atmospheric_corrections(),
        station.tmc.get_face(),
        station.tmc.do_measurement(),
    ):
        assert answer.error.name == "OK", answer
    answer = station.tmc.get_simple_coordinate()
    assert answer.error.name == "OK", answer
    print(*(1000 * value for value in (answer.params.x, answer.params.y, answer.params.z)))
