//! Enumerations of the interface. All of them are open: the manuals reserve ranges without listing them, so an unknown number is
//! kept and shown as a number.

use super::super::Failure;

/// Defines an enumeration of the wire: known numbers with a name and a text, all others as `Other`.
macro_rules! numbers {
    ($(#[$doc:meta])* $name:ident { $($number:literal $variant:ident $words:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $(#[doc = $words] $variant,)*
            /// An unlisted number.
            Other(i32),
        }

        impl $name {
            /// The variant of a number.
            pub const fn from_number(number: i32) -> Self {
                match number {
                    $($number => Self::$variant,)*
                    other => Self::Other(other),
                }
            }

            /// The number on the wire.
            pub const fn number(self) -> i32 {
                match self {
                    $(Self::$variant => $number,)*
                    Self::Other(number) => number,
                }
            }

            /// Meaning in words.
            pub const fn words(self) -> &'static str {
                match self {
                    $(Self::$variant => $words,)*
                    Self::Other(_) => "unlisted number",
                }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "{} ({})", self.words(), self.number())
            }
        }
    };
}

numbers! {
    /// Kind of a packet (`ES_DT_`).
    PacketType {
        0 Command "command",
        1 Error "error",
        2 SingleMeasResult "single measurement result",
        3 MultiMeasResult "continuous measurement result",
        4 StationaryProbeMeasResult "stationary probe result",
        5 ContinuousProbeMeasResult "continuous probe result",
        6 NivelResult "inclination result",
        7 ReflectorPosResult "reflector position",
        8 SystemStatusChange "system status change",
        9 SingleMeasResult2 "single measurement result, extended statistics",
        10 MultiMeasResult2 "continuous measurement result, extended statistics",
        11 ProbePosResult "probe position",
    }
}

numbers! {
    /// Command (`ES_C_`): those sent by this program or known to the simulated tracker.
    CommandId {
        1 GetSystemStatus "reading the system status",
        2 GetTrackerStatus "reading the tracker status",
        5 SetUnits "setting the units",
        6 GetUnits "reading the units",
        7 Initialize "initialising",
        12 SetStationOrientationParams "setting the station orientation",
        13 GetStationOrientationParams "reading the station orientation",
        14 SetTransformationParams "setting the transformation",
        15 GetTransformationParams "reading the transformation",
        20 SetEnvironmentParams "setting the weather",
        21 GetEnvironmentParams "reading the weather",
        24 SetMeasurementMode "setting the measurement mode",
        25 GetMeasurementMode "reading the measurement mode",
        26 SetCoordinateSystemType "setting the coordinate type",
        27 GetCoordinateSystemType "reading the coordinate type",
        28 SetStationaryModeParams "setting the measurement time",
        29 GetStationaryModeParams "reading the measurement time",
        40 SetReflector "selecting the reflector",
        41 GetReflector "reading the reflector",
        42 GetReflectors "reading the list of reflectors",
        47 SetSystemSettings "setting the system settings",
        48 GetSystemSettings "reading the system settings",
        49 StartMeasurement "measuring",
        52 StopMeasurement "stopping the measurement",
        55 GoPosition "turning to the SMR",
        80 SetStatisticMode "setting the kind of statistics",
        81 GetStatisticMode "reading the kind of statistics",
    }
}

numbers! {
    /// Answer to a command (`ES_RS_`). Only [`ResultStatus::AllOk`] is success.
    ResultStatus {
        0 AllOk "success",
        1 ServerBusy "the server is busy",
        2 NotImplemented "not implemented in this instrument",
        23 WrongCurrentReflector "wrong current reflector",
        26 NoTpFound "no tracker processor found",
        27 NoWeatherMonitor "no weather monitor",
        28 NoLastMeasuredPoint "no last measured point",
        30 NoAdm "no absolute distance meter",
        35 UsageConflict "usage conflict",
        36 Unknown "unknown error",
        37 NoDistanceSet "no valid distance: the beam was interrupted",
        38 NoTrackerConnected "no tracker connected",
        39 TrackerNotInitialized "the tracker is not initialised",
        40 ModuleNotStarted "module not started",
        41 ModuleTimedOut "module timed out",
        56 NoSuchCompensation "no such compensation",
        57 MeteoDataOutOfRange "weather values out of range",
        58 InCompensationMode "a compensation is in progress",
        94 NoTemperatureFromWeatherMonitor "no weather value from the weather monitor",
        95 NoPressureFromWeatherMonitor "no weather value from the weather monitor",
        96 NoHumidityFromWeatherMonitor "no weather value from the weather monitor",
        98 InvalidInputData "invalid input data",
        10002 NoValidAdmCompensation "no valid compensation of the distance meter",
        10003 PressureSensorProblem "pressure sensor problem",
        10004 MeasurementStatusNotReady "the measurement status is not ready",
        10005 AdmStartUpBusy "the distance meter is starting up",
        10009 NoStationaryMeasurementResult "no result of the stationary measurement",
        10010 SensorNotLeveled "the sensor is not levelled",
        10011 MultiConnectionsNotAllowed "another program is connected",
        10012 SensorNotWarmedUp "the sensor is not warmed up",
        10013 SensorNotStable "the sensor is not stable",
        10014 SystemNotReadyForMeasurement "the system is not ready for a measurement",
        10015 CommunicationWithSensorFailed "the controller cannot reach the sensor",
        10016 NoSensorBattery "no battery in the sensor",
        10018 WarmedUpStateReached "the sensor is warmed up now",
        10019 NotLeveledForInitialization "not levelled for the initialisation",
        10020 HardwareProblemAdm "hardware problem of the distance meter",
        10021 HardwareProblemAtr "hardware problem of the target recognition",
    }
}

numbers! {
    /// System status change (`ES_SSC_`).
    SystemEvent {
        0 DistanceSet "distance set",
        1 LaserWarmedUp "the laser is warmed up",
        2 EnvironmentChanged "weather values changed",
        6 UnitsChanged "the units were changed",
        7 ReflectorChanged "the reflector was changed",
        8 SystemSettingsChanged "the system settings were changed",
        11 CompensationChanged "the compensation was changed",
        12 CoordinateSystemTypeChanged "the coordinate type was changed",
        15 StationOrientationParamsChanged "the station orientation was changed",
        16 TransformationParamsChanged "the transformation was changed",
        17 MeasurementModeChanged "the measurement mode was changed",
        18 StationaryModeParamsChanged "the measurement time was changed",
        24 StatisticModeChanged "the statistic mode was changed",
        25 MeasStatusNotReady "not ready to measure",
        26 MeasStatusBusy "busy",
        27 MeasStatusReady "ready to measure",
        30 IsFace1 "face 1",
        31 IsFace2 "face 2",
        32 ExternalControlActive "external control is active",
        151 InitializationStatusChanged "the initialisation changed",
        850 SensorDetected "sensor detected",
        851 SensorDisconnected "sensor disconnected",
        853 BatteryStatus "the battery needs attention",
        997 TpConnectionClosing "the tracker processor closes the connection",
        998 ServerClosing "the server closes",
        999 ServerStarted "the server has started",
    }
}

numbers! {
    /// Readiness to measure.
    TrackerStatus {
        0 NotReady "not ready",
        1 Busy "busy",
        2 Ready "ready",
        3 SixDofStatusInvalid "6D status invalid",
    }
}

numbers! {
    /// The laser of the interferometer.
    LaserStatus {
        2 HeatingUp "warming up",
        3 Ready "ready",
        4 UnableToStabilize "unable to stabilise",
        5 Off "off",
    }
}

numbers! {
    /// The processor of the tracker.
    ProcessorStatus {
        0 NoTp "no tracker processor",
        3 Booted "booted",
        4 CompensationSet "compensation set",
        5 Initialized "initialised",
    }
}

numbers! {
    /// Measurement mode. 20 to 23 appear in newer interfaces only.
    MeasurementMode {
        0 Stationary "stationary",
        1 ContinuousTime "continuous in time",
        2 ContinuousDistance "continuous in distance",
        3 Grid "grid",
        4 SphereCenter "sphere centre",
        5 CircleCenter "circle centre",
        20 Fast "fast",
        21 Standard "standard",
        22 Precise "precise",
        23 Outdoor "outdoor",
    }
}

numbers! {
    /// Coordinate type.
    CoordinateType {
        0 RightHanded "right-handed x, y, z",
        1 LeftHandedX "left-handed, x mirrored",
        2 LeftHandedY "left-handed, y mirrored",
        3 LeftHandedZ "left-handed, z mirrored",
        4 CylindricalCounterClockwise "cylindrical, counter-clockwise",
        5 CylindricalClockwise "cylindrical, clockwise",
        6 SphericalClockwise "spherical, clockwise",
        7 SphericalCounterClockwise "spherical, counter-clockwise",
    }
}

numbers! {
    /// Unit of length.
    LengthUnit {
        0 Metre "m",
        1 Millimetre "mm",
        2 Micrometre "um",
        3 Foot "ft",
        4 Yard "yd",
        5 Inch "in",
    }
}

impl MeasurementMode {
    /// Whether one result in this mode is one point of a reflector at rest.
    pub const fn is_point(self) -> bool {
        matches!(self, Self::Stationary | Self::Fast | Self::Standard | Self::Precise | Self::Outdoor)
    }
}

impl ResultStatus {
    /// Whether the command was carried out: with success, or with a parameter that was set to the nearest possible value. What was
    /// set is read back in any case.
    pub const fn is_done(self) -> bool {
        matches!(self, Self::AllOk | Self::Other(11 | 13 | 15 | 17 | 19 | 21))
    }

    /// The failure for a status other than success, during the action `what`.
    pub fn failure(self, what: &str) -> Failure {
        let text = format!("{what}: {}", self.described());
        match self {
            Self::NoDistanceSet | Self::NoStationaryMeasurementResult => Failure::NoTarget(text),
            Self::SensorNotStable => Failure::Unstable(text),
            Self::UsageConflict | Self::MultiConnectionsNotAllowed => Failure::InUse(text),
            Self::WrongCurrentReflector => Failure::Settings(text),
            Self::NoWeatherMonitor
            | Self::MeteoDataOutOfRange
            | Self::NoTemperatureFromWeatherMonitor
            | Self::NoPressureFromWeatherMonitor
            | Self::NoHumidityFromWeatherMonitor
            | Self::PressureSensorProblem => {
                Failure::Settings(format!("{text}; enter temperature, pressure and humidity at the tracker"))
            }
            Self::ServerBusy
            | Self::TrackerNotInitialized
            | Self::MeasurementStatusNotReady
            | Self::AdmStartUpBusy
            | Self::SensorNotWarmedUp
            | Self::SystemNotReadyForMeasurement => Failure::NotReady(text),
            _ => Failure::Refused(text),
        }
    }

    /// The failure for an accepted measurement that ended with this status. The error number of a broken beam is not published,
    /// so an unlisted number is taken for it.
    pub fn measurement_failure(self) -> Failure {
        match self {
            Self::Other(number) if !(3..=22).contains(&number) => {
                Failure::NoTarget(format!("the measurement ended with error {number}, as after a broken beam"))
            }
            _ => self.failure("the measurement ended"),
        }
    }

    /// Meaning and number, including ranges whose single numbers have no names.
    pub fn described(self) -> String {
        match self {
            Self::Other(number @ 3..=10) => format!("wrong parameter ({number})"),
            Self::Other(number @ 11..=22) => format!("parameter out of range ({number})"),
            _ => self.to_string(),
        }
    }
}
