//! The set-up: every setting that a point depends on is set and read back, and read again whenever the tracker says that it
//! changed.
//!
//! A whole set-up writes first. A re-check reads first and writes only what differs, so that the tracker's announcement of our
//! own change, which may come late, costs one reading and no endless loop. What cannot be set again without changing what the
//! points mean (the frame, the reflector) ends the link instead.

use std::collections::VecDeque;
use std::time::Duration;

use super::super::{Failure, Identity, Reflector};
use super::EmsconOptions;
use super::command::{Command, SystemSettings, Units};
use super::packet::{Fields, PacketError, Reply};
use super::status::{
    CoordinateType, LaserStatus, MeasurementMode, ProcessorStatus, ResultStatus, SystemEvent, TrackerStatus,
};
use super::step::{Setting, Step, reading_of};

/// A laser that warms up is asked again after this.
pub(super) const WARM_UP_PAUSE: Duration = Duration::from_secs(5);

/// Reflectors that are remembered at most; trackers have a few dozen.
pub(super) const MAX_REFLECTORS: usize = 256;

/// Transformation without effect: translation, rotation, scale.
const NO_TRANSFORMATION: [f64; 7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Parameters of a frame that differ by no more than this are the same.
const SAME: f64 = 1e-12;

/// What follows an answer.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Outcome {
    /// The step is done.
    Done,
    /// The same answer has more packets.
    More,
    /// The same question again after the warm-up pause; why, in words.
    Wait(String),
}

/// A set-up or re-check under way, and what was found in it.
#[derive(Clone, Debug)]
pub(super) struct SetUp {
    options: EmsconOptions,
    steps: VecDeque<Step>,
    is_whole: bool,
    /// Steps that this tracker does not know.
    unsupported: Vec<Step>,
    system: Option<SystemSettings>,
    transformation: Option<[f64; 7]>,
    orientation: Option<[f64; 6]>,
    reflectors: Vec<Reflector>,
    reflector: Option<i32>,
    listed: usize,
    name: String,
    checked: Vec<String>,
    warnings: Vec<String>,
    /// Duration of a measurement that the tracker keeps (ms).
    pub measure_ms: i32,
}

impl SetUp {
    /// A whole set-up.
    pub(super) fn whole(options: EmsconOptions) -> Self {
        let mut steps = vec![
            Step::SystemStatus,
            Step::TrackerStatus,
            Step::Write(Setting::Units),
            Step::Check(Setting::Units),
            Step::Write(Setting::Coordinates),
            Step::Check(Setting::Coordinates),
            Step::Read(Setting::System),
            Step::Transformation,
            Step::StationOrientation,
        ];
        if options.initialize {
            steps.push(Step::Initialize);
        }
        steps.push(Step::Reflectors);
        if options.reflector.is_some() {
            steps.extend([Step::Write(Setting::Reflector), Step::Check(Setting::Reflector)]);
        } else {
            steps.push(Step::Read(Setting::Reflector));
        }
        steps.extend([
            Step::Write(Setting::Mode),
            Step::Check(Setting::Mode),
            Step::Write(Setting::Stationary),
            Step::Check(Setting::Stationary),
            Step::TrackerStatus,
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

    /// Begins a re-check of everything that a point depends on.
    pub(super) fn recheck(&mut self) {
        self.is_whole = false;
        let steps = [
            Step::Read(Setting::Units),
            Step::Read(Setting::Coordinates),
            Step::Read(Setting::System),
            Step::Transformation,
            Step::StationOrientation,
            Step::Read(Setting::Reflector),
            Step::Read(Setting::Mode),
            Step::Read(Setting::Stationary),
            Step::TrackerStatus,
        ];
        self.steps = steps.into_iter().filter(|step| !self.unsupported.contains(step)).collect();
    }

    /// The step under way.
    pub(super) fn step(&self) -> Option<Step> {
        self.steps.front().copied()
    }

    /// True where the step that is to come, or is under way, reads what the event says has changed.
    pub(super) fn will_read(&self, event: SystemEvent) -> bool {
        let Some(reading) = reading_of(event) else { return true };
        self.steps.iter().any(|step| match (step, reading) {
            (Step::Read(setting) | Step::Check(setting), Step::Read(changed)) => *setting == changed,
            (step, reading) => *step == reading,
        })
    }

    /// The command of the step under way.
    pub(super) fn command(&self) -> Option<Command> {
        Some(match self.step()? {
            Step::Write(setting) => self.write(setting),
            other => Command::bare(other.command()),
        })
    }

    /// Who answered, what was checked and what to know. Leaves the lists empty for the next re-check.
    pub(super) fn identity(&mut self) -> Identity {
        Identity {
            name: self.name.clone(),
            reflector: self.current_reflector(),
            checked: std::mem::take(&mut self.checked),
            warnings: std::mem::take(&mut self.warnings),
            notes: Vec::new(),
        }
    }

    /// The step under way was refused.
    ///
    /// # Errors
    /// Nothing can be measured without it.
    pub(super) fn refused(&mut self, status: ResultStatus) -> Result<Outcome, Failure> {
        let Some(step) = self.steps.pop_front() else { return Ok(Outcome::Done) };
        let what = step.command().words();
        let failure = status.failure(what);
        if self.is_needed(step) || matches!(failure, Failure::InUse(_)) {
            return Err(failure);
        }
        self.unsupported.push(step);
        if let Step::Write(setting) = step {
            self.steps.retain(|next| *next != Step::Check(setting));
            self.unsupported.push(Step::Read(setting));
        }
        self.warnings.push(format!("{what}: {}; the set-up went on without it", status.described()));
        Ok(Outcome::Done)
    }

    /// The step under way was answered with success.
    ///
    /// # Errors
    /// The tracker is set in a way in which nothing can be measured, or the answer is too short.
    pub(super) fn answered(&mut self, reply: &Reply) -> Result<Outcome, Failure> {
        let Some(step) = self.step() else { return Ok(Outcome::Done) };
        let outcome = self.judge(step, reply)?;
        if outcome == Outcome::Done {
            self.steps.pop_front();
        }
        Ok(outcome)
    }

    fn judge(&mut self, step: Step, reply: &Reply) -> Result<Outcome, Failure> {
        match step {
            Step::SystemStatus => return self.judge_system(fields(reply, 56)?),
            Step::TrackerStatus => {
                let status = TrackerStatus::from_number(fields(reply, 20)?.i32(16));
                if self.steps.len() == 1 && status != TrackerStatus::Ready {
                    self.warnings.push(format!("tracker status: {status}"));
                }
            }
            Step::Reflectors => return self.list(fields(reply, 100)?),
            Step::Transformation => self.judge_transformation(fields(reply, 72)?.numbers(16))?,
            Step::StationOrientation => self.judge_orientation(fields(reply, 64)?.numbers(16))?,
            Step::Read(setting) => self.judge_setting(setting, reply, false)?,
            Step::Check(setting) => self.judge_setting(setting, reply, true)?,
            Step::Initialize => self.checked.push("initialised".to_owned()),
            Step::Write(_) => {}
        }
        Ok(Outcome::Done)
    }

    fn judge_system(&mut self, fields: Fields<'_>) -> Result<Outcome, Failure> {
        let laser = LaserStatus::from_number(fields.i32(24));
        match laser {
            LaserStatus::HeatingUp | LaserStatus::Off => {
                return Ok(Outcome::Wait(format!(
                    "the laser is {}; the set-up waits until it is ready",
                    laser.words()
                )));
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
            let text =
                "the tracker transforms its points (scale 1): distances stay right, points are not in its own frame";
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
            Err(Failure::Settings(format!("{name}: asked for {wanted}, read back {found}")))
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
            let text = "another frame is applied than before; points before and after do not fit together";
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
            return Err(Failure::Settings("the tracker does not announce changes of its settings".to_owned()));
        } else {
            self.warnings.push(format!("system settings: asked for {wanted}, read back {found}"));
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
            (false, true) => self.warnings.push(text),
            (false, false) => self.write_next(Setting::Stationary),
        }
    }

    fn judge_reflector(&mut self, id: i32) -> Result<(), Failure> {
        let wanted = self.options.reflector.or(if self.is_whole { None } else { self.reflector });
        if let Some(wanted) = wanted.filter(|wanted| *wanted != id) {
            return Err(Failure::Settings(format!(
                "reflector: expected {}, the tracker has {}; points with different reflectors do not fit together",
                self.reflector_name(wanted),
                self.reflector_name(id)
            )));
        }
        self.reflector = Some(id);
        self.checked.push(format!("reflector: {} (read back)", self.reflector_name(id)));
        Ok(())
    }

    /// One packet of the list of reflectors. Their number decides where the list ends.
    fn list(&mut self, fields: Fields<'_>) -> Result<Outcome, Failure> {
        let total = usize::try_from(fields.i32(16)).unwrap_or(0);
        let reflector = Reflector { id: fields.i32(20), name: fields.name(36), offset: fields.f64(28) / 1000.0 };
        if total > 0 && !reflector.offset.is_finite() {
            return Err(Failure::Garbled(format!("the offset of reflector {} is no number", reflector.id)));
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

    /// The settings that are to be, with everything kept that is not our business.
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

    /// Puts the writing and checking of a setting behind the step under way.
    fn write_next(&mut self, setting: Setting) {
        let rest = self.steps.split_off(self.steps.len().min(1));
        self.steps.extend([Step::Write(setting), Step::Check(setting)]);
        self.steps.extend(rest);
    }

    /// True where nothing can be measured without the step.
    fn is_needed(&self, step: Step) -> bool {
        match step {
            Step::SystemStatus | Step::TrackerStatus | Step::Initialize => true,
            Step::Read(setting) | Step::Write(setting) | Step::Check(setting) => match setting {
                Setting::Units | Setting::Coordinates | Setting::Mode => true,
                Setting::Reflector => self.options.reflector.is_some(),
                Setting::System | Setting::Stationary => false,
            },
            Step::Transformation | Step::StationOrientation | Step::Reflectors => false,
        }
    }
}

fn fields(reply: &Reply, least: usize) -> Result<Fields<'_>, Failure> {
    reply.fields(least).map_err(|error: PacketError| Failure::Garbled(error.to_string()))
}

fn is_same(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME)
}

/// Keeps what was found first. Later it has to be the same: points before and after would not share a frame.
fn unchanged<const N: usize>(what: &str, kept: &mut Option<[f64; N]>, found: [f64; N]) -> Result<(), Failure> {
    match kept {
        Some(kept) if !is_same(kept.as_slice(), &found) => {
            Err(Failure::Settings(format!("the {what} was changed; points before and after do not fit together")))
        }
        _ => {
            *kept = Some(found);
            Ok(())
        }
    }
}
