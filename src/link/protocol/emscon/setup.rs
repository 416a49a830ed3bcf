//! The set-up: writes and reads back every setting that points depend on, and reads it again whenever the tracker reports a
//! change.
//!
//! A whole set-up writes first. A re-check reads first and writes only what differs, so that a late announcement of our own
//! change costs one reading instead of an endless loop. A changed frame or reflector ends the link, because writing it back
//! would not tell which points were measured with which.

use std::collections::VecDeque;
use std::time::Duration;

use super::super::{Failure, Identity, Reflector};
use super::EmsconOptions;
use super::command::{Command, SystemSettings, Units};
use super::packet::{Fields, PacketError, Reply};
use super::status::{
    CoordinateType, LaserStatus, MeasurementMode, ProcessorStatus, ResultStatus, SystemEvent, TrackerStatus,
};
use super::step::{SetUpStep, Setting, reading_of};

/// Interval at which a laser that is warming up is polled.
pub(super) const WARM_UP_PAUSE: Duration = Duration::from_secs(5);

/// Most reflectors that are kept; trackers have a few dozen.
pub(super) const MAX_REFLECTORS: usize = 256;

/// The identity transformation: translation, rotation, scale.
const NO_TRANSFORMATION: [f64; 7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Largest difference at which parameters of a frame count as equal.
const SAME: f64 = 1e-12;

/// What follows after an answer.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Outcome {
    /// The step is complete.
    Done,
    /// The answer has more packets.
    More,
    /// The command must be repeated after the warm-up pause, for this reason.
    Wait(String),
}

/// A set-up or re-check in progress, with its findings.
#[derive(Clone, Debug)]
pub(super) struct SetUp {
    options: EmsconOptions,
    steps: VecDeque<SetUpStep>,
    is_whole: bool,
    /// Steps that this tracker does not support.
    unsupported: Vec<SetUpStep>,
    system: Option<SystemSettings>,
    transformation: Option<[f64; 7]>,
    orientation: Option<[f64; 6]>,
    reflectors: Vec<Reflector>,
    reflector: Option<i32>,
    listed: usize,
    name: String,
    checked: Vec<String>,
    warnings: Vec<String>,
    /// Duration of a measurement that is set at the tracker (ms).
    pub measure_ms: i32,
}

impl SetUp {
    /// The steps of a whole set-up.
    pub(super) fn whole(options: EmsconOptions) -> Self {
        let mut steps = vec![
            SetUpStep::SystemStatus,
            SetUpStep::TrackerStatus,
            SetUpStep::Write(Setting::Units),
            SetUpStep::Check(Setting::Units),
            SetUpStep::Write(Setting::Coordinates),
            SetUpStep::Check(Setting::Coordinates),
            SetUpStep::Read(Setting::System),
            SetUpStep::Transformation,
            SetUpStep::StationOrientation,
        ];
        if options.initialize {
            steps.push(SetUpStep::Initialize);
        }
        steps.push(SetUpStep::Reflectors);
        if options.reflector.is_some() {
            steps.extend([SetUpStep::Write(Setting::Reflector), SetUpStep::Check(Setting::Reflector)]);
        } else {
            steps.push(SetUpStep::Read(Setting::Reflector));
        }
        steps.extend([
            SetUpStep::Write(Setting::Mode),
            SetUpStep::Check(Setting::Mode),
            SetUpStep::Write(Setting::Stationary),
            SetUpStep::Check(Setting::Stationary),
            SetUpStep::TrackerStatus,
        ]);
        Self {
            measure_ms: options.measure_ms,
            options,
            steps: steps.into(),
            is_whole: true,
            unsupported: Vec::new(),
            system: None,
            transformation: None,
            orientation: None,
            reflectors: Vec::new(),
            reflector: None,
            listed: 0,
            name: String::new(),
            checked: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Starts a re-check of everything that points depend on.
    pub(super) fn recheck(&mut self) {
        self.is_whole = false;
        let steps = [
            SetUpStep::Read(Setting::Units),
            SetUpStep::Read(Setting::Coordinates),
            SetUpStep::Read(Setting::System),
            SetUpStep::Transformation,
            SetUpStep::StationOrientation,
            SetUpStep::Read(Setting::Reflector),
            SetUpStep::Read(Setting::Mode),
            SetUpStep::Read(Setting::Stationary),
            SetUpStep::TrackerStatus,
        ];
        self.steps = steps.into_iter().filter(|step| !self.unsupported.contains(step)).collect();
    }

    /// The current step.
    pub(super) fn step(&self) -> Option<SetUpStep> {
        self.steps.front().copied()
    }

    /// Whether the current or a later step reads the setting changed by this event.
    pub(super) fn will_read(&self, event: SystemEvent) -> bool {
        let Some(reading) = reading_of(event) else { return true };
        self.steps.iter().any(|step| match (step, reading) {
            (SetUpStep::Read(setting) | SetUpStep::Check(setting), SetUpStep::Read(changed)) => *setting == changed,
            (step, reading) => *step == reading,
        })
    }

    /// The command of the current step.
    pub(super) fn command(&self) -> Option<Command> {
        Some(match self.step()? {
            SetUpStep::Write(setting) => self.write(setting),
            other => Command::bare(other.command()),
        })
    }

    /// Identity, checked settings and warnings. Empties the lists for the next re-check.
    pub(super) fn identity(&mut self) -> Identity {
        Identity {
            name: self.name.clone(),
            reflector: self.current_reflector(),
            checked: std::mem::take(&mut self.checked),
            warnings: std::mem::take(&mut self.warnings),
            notes: Vec::new(),
        }
    }

    /// Handles the refusal of the current step.
    ///
    /// # Errors
    /// The step is required for measurements.
    pub(super) fn refused(&mut self, status: ResultStatus) -> Result<Outcome, Failure> {
        let Some(step) = self.steps.pop_front() else { return Ok(Outcome::Done) };
        let what = step.command().words();
        let failure = status.failure(what);
        if self.is_needed(step) || matches!(failure, Failure::InUse(_)) {
            return Err(failure);
        }
        self.unsupported.push(step);
        if let SetUpStep::Write(setting) = step {
            self.steps.retain(|next| *next != SetUpStep::Check(setting));
            self.unsupported.push(SetUpStep::Read(setting));
        }
        self.warnings.push(format!("{what}: {}; continued without it", status.described()));
        Ok(Outcome::Done)
    }

    /// Handles a successful answer to the current step.
    ///
    /// # Errors
    /// A setting does not allow measurements, or the answer is too short.
    pub(super) fn answered(&mut self, reply: &Reply) -> Result<Outcome, Failure> {
        let Some(step) = self.step() else { return Ok(Outcome::Done) };
        let outcome = self.judge(step, reply)?;
        if outcome == Outcome::Done {
            self.steps.pop_front();
        }
        Ok(outcome)
    }

    fn judge(&mut self, step: SetUpStep, reply: &Reply) -> Result<Outcome, Failure> {
        match step {
            SetUpStep::SystemStatus => return self.judge_system(fields(reply, 56)?),
            SetUpStep::TrackerStatus => {
                let status = TrackerStatus::from_number(fields(reply, 20)?.i32(16));
                if self.steps.len() == 1 && status != TrackerStatus::Ready {
                    self.warnings.push(format!("tracker status: {status}"));
                }
            }
            SetUpStep::Reflectors => return self.list(fields(reply, 100)?),
            SetUpStep::Transformation => self.judge_transformation(fields(reply, 72)?.numbers(16))?,
            SetUpStep::StationOrientation => self.judge_orientation(fields(reply, 64)?.numbers(16))?,
            SetUpStep::Read(setting) => self.judge_setting(setting, reply, false)?,
            SetUpStep::Check(setting) => self.judge_setting(setting, reply, true)?,
            SetUpStep::Initialize => self.checked.push("initialised".to_owned()),
            SetUpStep::Write(_) => {}
        }
        Ok(Outcome::Done)
    }

    fn judge_system(&mut self, fields: Fields<'_>) -> Result<Outcome, Failure> {
        let laser = LaserStatus::from_number(fields.i32(24));
        match laser {
            LaserStatus::HeatingUp | LaserStatus::Off => {
                return Ok(Outcome::Wait(format!("the laser is {}; waiting until it is ready", laser.words())));
            }
            LaserStatus::UnableToStabilize => return Err(Failure::NotReady(format!("laser: {laser}"))),
            LaserStatus::Ready => self.checked.push("laser: ready".to_owned()),
            LaserStatus::Other(_) => self.warnings.push(format!("laser: {laser}")),
        }
        let processor = ProcessorStatus::from_number(fields.i32(20));
        if processor != ProcessorStatus::Initialized && !self.options.initialize {
            self.warnings.push(format!("tracker processor: {processor}; initialise the tracker before measuring"));
        }
        let [major, minor, build] = fields.integers(32);
        self.name = format!("Leica emScon tracker, serial {}, version {major}.{minor}.{build}", fields.i32(52));
        Ok(Outcome::Done)
    }

    fn judge_transformation(&mut self, values: [f64; 7]) -> Result<(), Failure> {
        let is_applied = self.system.is_none_or(|settings| settings.apply_transformation_params != 0);
        let [.., scale] = values;
        if is_applied && !is_same(&[scale], &[1.0]) {
            return Err(Failure::Scaled(scale));
        }
        if is_applied && !is_same(&values, &NO_TRANSFORMATION) && self.is_whole {
            let text = "the tracker transforms its points (scale 1): distances stay right, but points are not in its own frame";
            self.warnings.push(text.to_owned());
        }
        unchanged("transformation", &mut self.transformation, values)
    }

    fn judge_orientation(&mut self, values: [f64; 6]) -> Result<(), Failure> {
        let is_applied = self.system.is_none_or(|settings| settings.apply_station_orientation_params != 0);
        if is_applied && !is_same(&values, &[0.0; 6]) && self.is_whole {
            self.warnings.push("the tracker applies a station orientation; points are not in its own frame".to_owned());
        }
        unchanged("station orientation", &mut self.orientation, values)
    }

    fn judge_setting(&mut self, setting: Setting, reply: &Reply, is_check: bool) -> Result<(), Failure> {
        let (found, wanted) = match setting {
            Setting::Units => {
                let units = Units::from_numbers(fields(reply, 36)?.integers(16));
                (units.to_string(), Units::WANTED.to_string())
            }
            Setting::Coordinates => {
                let kind = CoordinateType::from_number(fields(reply, 20)?.i32(16));
                (kind.to_string(), CoordinateType::RightHanded.to_string())
            }
            Setting::Mode => {
                let mode = MeasurementMode::from_number(fields(reply, 20)?.i32(16));
                (mode.to_string(), MeasurementMode::Stationary.to_string())
            }
            Setting::System => return self.judge_settings(fields(reply, 52)?, is_check),
            Setting::Stationary => {
                self.judge_stationary(fields(reply, 24)?, is_check);
                return Ok(());
            }
            Setting::Reflector => return self.judge_reflector(fields(reply, 20)?.i32(16)),
        };
        let name = setting.name();
        if found == wanted {
            self.checked.push(format!("{name}: {found} (read back)"));
            Ok(())
        } else if is_check {
            Err(Failure::Settings(format!("{name}: requested {wanted}, read back {found}")))
        } else {
            self.write_next(setting);
            Ok(())
        }
    }

    fn judge_settings(&mut self, fields: Fields<'_>, is_check: bool) -> Result<(), Failure> {
        let found = SystemSettings::from_numbers(fields.integers(16));
        let wanted = self.wanted(found);
        let applied = |settings: SystemSettings| {
            [settings.apply_transformation_params, settings.apply_station_orientation_params].map(|flag| flag != 0)
        };
        if self.system.is_some_and(|before| applied(before) != applied(found)) {
            let text = "another frame is applied than before; points before and after the change do not fit together";
            return Err(Failure::Settings(text.to_owned()));
        }
        self.system = Some(found);
        if found.weather_monitor_status == 0 {
            self.warnings.push("no weather monitor: check the weather values at the tracker".to_owned());
        }
        if found == wanted {
            self.checked.push(format!("system settings: {found} (read back)"));
        } else if !is_check {
            self.write_next(Setting::System);
        } else if found.try_measurement_mode != 0 {
            return Err(Failure::Settings("the try mode cannot be switched off".to_owned()));
        } else if found.send_unsolicited_messages == 0 {
            return Err(Failure::Settings("the tracker does not report changes of its settings".to_owned()));
        } else {
            self.warnings.push(format!("system settings: requested {wanted}, read back {found}"));
        }
        Ok(())
    }

    fn judge_stationary(&mut self, fields: Fields<'_>, is_check: bool) {
        let (milliseconds, adm) = (fields.i32(16), fields.i32(20));
        self.measure_ms = milliseconds.max(self.options.measure_ms);
        let is_right = milliseconds == self.options.measure_ms && (adm != 0) == self.options.use_adm;
        let text = format!("measurement time: {milliseconds} ms, distance meter {adm} (read back)");
        match (is_right, is_check) {
            (true, _) => self.checked.push(text),
            // Some trackers choose both on their own; a point does not depend on them.
            (false, true) => self.checked.push(format!("{text}, which the tracker chooses")),
            (false, false) => self.write_next(Setting::Stationary),
        }
    }

    fn judge_reflector(&mut self, id: i32) -> Result<(), Failure> {
        let wanted = self.options.reflector.or(if self.is_whole { None } else { self.reflector });
        if let Some(wanted) = wanted.filter(|wanted| *wanted != id) {
            return Err(Failure::Settings(format!(
                "reflector: expected {}, the tracker uses {}; points with different reflectors do not fit together",
                self.reflector_name(wanted),
                self.reflector_name(id)
            )));
        }
        self.reflector = Some(id);
        self.checked.push(format!("reflector: {} (read back)", self.reflector_name(id)));
        Ok(())
    }

    /// Handles one packet of the list of reflectors. The list ends after the number that each packet states.
    fn list(&mut self, fields: Fields<'_>) -> Result<Outcome, Failure> {
        let total = usize::try_from(fields.i32(16)).unwrap_or(0);
        let reflector = Reflector { id: fields.i32(20), name: fields.name(36), offset: fields.f64(28) / 1000.0 };
        if total > 0 && !reflector.offset.is_finite() {
            return Err(Failure::Garbled(format!("the offset of reflector {} is not a number", reflector.id)));
        }
        self.listed += 1;
        if total > 0 && self.reflectors.len() < MAX_REFLECTORS {
            self.reflectors.push(reflector);
        }
        Ok(if self.listed < total { Outcome::More } else { Outcome::Done })
    }

    fn current_reflector(&self) -> Option<Reflector> {
        let id = self.reflector?;
        self.reflectors.iter().find(|reflector| reflector.id == id).cloned()
    }

    fn reflector_name(&self, id: i32) -> String {
        match self.reflectors.iter().find(|reflector| reflector.id == id) {
            Some(known) => format!("'{}' ({id}), surface offset {:.4} mm", known.name, known.offset * 1000.0),
            None => format!("number {id}, which is not in the tracker's list"),
        }
    }

    /// The required settings; all others are kept as found.
    fn wanted(&self, found: SystemSettings) -> SystemSettings {
        SystemSettings {
            weather_monitor_status: if found.weather_monitor_status == 0 { 0 } else { 2 },
            send_unsolicited_messages: 1,
            send_reflector_position_data: i32::from(self.options.reflector_positions),
            try_measurement_mode: 0,
            ..found
        }
    }

    fn write(&self, setting: Setting) -> Command {
        match setting {
            Setting::Units => Command::set_units(Units::WANTED),
            Setting::Coordinates => Command::set_coordinate_type(CoordinateType::RightHanded),
            Setting::Mode => Command::set_measurement_mode(MeasurementMode::Stationary),
            Setting::Stationary => Command::set_stationary_params(self.options.measure_ms, self.options.use_adm),
            Setting::Reflector => Command::set_reflector(self.options.reflector.or(self.reflector).unwrap_or_default()),
            Setting::System => {
                let found = self.system.unwrap_or_else(|| SystemSettings::from_numbers([0; 9]));
                Command::set_system_settings(self.wanted(found))
            }
        }
    }

    /// Inserts steps to write and check a setting after the current one.
    fn write_next(&mut self, setting: Setting) {
        let rest = self.steps.split_off(self.steps.len().min(1));
        self.steps.extend([SetUpStep::Write(setting), SetUpStep::Check(setting)]);
        self.steps.extend(rest);
    }

    /// Whether measurements require the step.
    fn is_needed(&self, step: SetUpStep) -> bool {
        match step {
            SetUpStep::SystemStatus | SetUpStep::TrackerStatus | SetUpStep::Initialize => true,
            SetUpStep::Read(setting) | SetUpStep::Write(setting) | SetUpStep::Check(setting) => match setting {
                Setting::Units | Setting::Coordinates | Setting::Mode => true,
                Setting::Reflector => self.options.reflector.is_some(),
                Setting::System | Setting::Stationary => false,
            },
            SetUpStep::Transformation | SetUpStep::StationOrientation | SetUpStep::Reflectors => false,
        }
    }
}

fn fields(reply: &Reply, least: usize) -> Result<Fields<'_>, Failure> {
    reply.fields(least).map_err(|error: PacketError| Failure::Garbled(error.to_string()))
}

fn is_same(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME)
}

/// Keeps the first value and rejects a different one later, because points before and after would not share a frame.
fn unchanged<const N: usize>(what: &str, kept: &mut Option<[f64; N]>, found: [f64; N]) -> Result<(), Failure> {
    match kept {
        Some(kept) if !is_same(kept.as_slice(), &found) => Err(Failure::Settings(format!(
            "the {what} was changed; points before and after the change do not fit together"
        ))),
        _ => {
            *kept = Some(found);
            Ok(())
        }
    }
}
