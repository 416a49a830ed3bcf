"""Measures one point with CESAPI and prints it in mm. Asks for the weather and the settings on the way."""
import logging
import sys

logging.disable(logging.CRITICAL)
from CESAPI.command import CommandSync
from CESAPI.connection import Connection
from CESAPI.packet import ES_CS_RHR, ES_MM_Stationary, SystemUnitsDataT

connection = Connection()
connection.connect(host="127.0.0.1", port=int(sys.argv[1]))
tracker = CommandSync(connection)
units = SystemUnitsDataT()
units.lenUnitType = 1
units.angUnitType = 0
tracker.SetUnits(units)
tracker.Initialize()
tracker.SetCoordinateSystemType(ES_CS_RHR)
tracker.SetMeasurementMode(ES_MM_Stationary)
weather = tracker.GetEnvironmentParams().environmentData
assert 800 < weather.dPressure < 1100 and -20 < weather.dTemperature < 50, vars(weather)
for ask in ("GetSystemStatus", "GetTrackerStatus", "GetUnits", "GetReflectors", "GetReflector", "GetStationOrientationParams",
            "GetTransformationParams", "GetStatisticMode", "GetSystemSettings"):
    getattr(tracker, ask)()
point = tracker.StartMeasurement()
print(point.dVal1, point.dVal2, point.dVal3)
connection.disconnect()
