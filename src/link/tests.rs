//! Links over real sockets and pseudo-terminals, with simulators that misbehave: no wrong point, the right words, and back again.

#![expect(clippy::disallowed_methods, reason = "deadlines of tests")]

mod contract;
mod robots;
mod wires;

use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use nalgebra::Point3;

use super::protocol::abb::{Abb, AbbOptions};
use super::protocol::ascii::{AsciiOptions, AsciiProtocol};
use super::protocol::emscon::{Emscon, EmsconOptions};
use super::protocol::fanuc::Fanuc;
use super::protocol::geocom::{GeocomOptions, GeocomProtocol};
use super::protocol::joints::JointLines;
use super::protocol::kuka::Kuka;
use super::protocol::ndi::{NdiOptions, NdiProtocol};
use super::protocol::rtde::Rtde;
use super::protocol::yaskawa::{Yaskawa, YaskawaOptions};
use super::protocol::{JointState, Protocol, Shot};
use super::serve::{Endpoint, Speedup, serve};
use super::simulator::PointSource;
use super::simulator::abb::AbbFault;
use super::simulator::ascii::AsciiFault;
use super::simulator::emscon::EmsconFault;
use super::simulator::fanuc::FanucFault;
use super::simulator::geocom::GeocomFault;
use super::simulator::joints::JointsFault;
use super::simulator::kuka::KukaFault;
use super::simulator::ndi::NdiFault;
use super::simulator::rtde::RtdeFault;
use super::simulator::yaskawa::{PULSES_PER_DEGREE, YaskawaFault};
use super::transport::Stopwatch;
use super::wire::Wire;
use super::{Link as _, LinkError, LinkEvent, RawLog, Wired, build};
use crate::session::reading::{MeasureRequest, Reading};
use crate::session::wire::{WireAddress, WireProtocol};

/// Nothing here takes longer.
const DEADLINE: Duration = Duration::from_mins(1);

/// What a simulated instrument looks at, and a test with it.
#[derive(Clone, Debug)]
struct Stage(Arc<Mutex<Scene>>);

#[derive(Debug)]
struct Scene {
    shots: u32,
    joints: JointState,
    /// The first joint turns by so much with every shot (rad).
    turns: f64,
    /// Standard deviation that is stated (m).
    sigma: f64,
    clock: Stopwatch,
}

impl Stage {
    fn new() -> Self {
        let positions = vec![0.1, -1.2, 1.3, -0.4, 0.5, -0.6];
        let joints = JointState::at(positions);
        Self(Arc::new(Mutex::new(Scene { shots: 0, joints, turns: 0.0, sigma: 5e-6, clock: Stopwatch::start() })))
    }

    fn lock(&self) -> MutexGuard<'_, Scene> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn shots(&self) -> u32 {
        self.lock().shots
    }

    /// Endpoint of the shot with this number (m); no two are alike.
    fn point(shot: u32) -> Point3<f64> {
        Point3::new(1.2345 + 0.001 * f64::from(shot), -0.67825, 0.090_125)
    }
}

impl PointSource for Stage {
    fn shot(&mut self) -> Option<Shot> {
        let mut scene = self.lock();
        scene.shots += 1;
        let turns = scene.turns;
        if let Some(first) = scene.joints.positions.first_mut() {
            *first += turns;
        }
        Some(Shot { sigma: Some([scene.sigma; 3]), ..Shot::bare(Self::point(scene.shots)) })
    }

    fn position(&mut self) -> Option<Shot> {
        Some(Shot::bare(Self::point(self.lock().shots)))
    }

    fn joints(&mut self) -> JointState {
        let scene = self.lock();
        JointState { controller_time: scene.clock.now().as_secs_f64(), ..scene.joints.clone() }
    }
}

/// An instrument on a wire with its simulator.
struct Bench {
    stage: Stage,
    wired: Wired,
    stop: Arc<AtomicBool>,
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// The protocols with limits that are worth waiting for in a test.
fn quick(protocol: WireProtocol) -> Box<dyn Protocol> {
    match protocol {
        WireProtocol::Emscon => Box::new(Emscon::new(EmsconOptions {
            measure_ms: 50,
            result_margin: Duration::from_millis(400),
            ..EmsconOptions::default()
        })),
        WireProtocol::Ascii => {
            let rehearsal = build::rehearsal_options(WireProtocol::Ascii).unwrap();
            let options: AsciiOptions = ron::from_str(&rehearsal).unwrap();
            Box::new(AsciiProtocol::new(AsciiOptions { timeout_s: 0.5, ..options }).unwrap())
        }
        WireProtocol::Geocom => {
            let options = GeocomOptions { checksum: true, timeout_s: 1.0, ..GeocomOptions::default() };
            Box::new(GeocomProtocol::new(options).unwrap())
        }
        WireProtocol::Ndi => {
            Box::new(NdiProtocol::new(NdiOptions { timeout_s: 0.5, ..NdiOptions::default() }).unwrap())
        }
        WireProtocol::Rtde => Box::new(Rtde::default()),
        WireProtocol::Joints => Box::new(JointLines::default()),
        WireProtocol::Kuka => Box::new(Kuka::default()),
        WireProtocol::Fanuc => Box::new(Fanuc::default()),
        WireProtocol::Yaskawa => {
            Box::new(Yaskawa::new(YaskawaOptions { pulses_per_degree: PULSES_PER_DEGREE.to_vec() }).unwrap())
        }
        WireProtocol::Abb => Box::new(Abb::new(AbbOptions::default()).unwrap()),
    }
}

/// Names of the faults of a simulator.
fn fault_names(protocol: WireProtocol) -> Vec<&'static str> {
    match protocol {
        WireProtocol::Emscon => EmsconFault::ALL.iter().map(|fault| fault.name()).collect(),
        WireProtocol::Joints => JointsFault::ALL.iter().map(|fault| fault.name()).collect(),
        WireProtocol::Fanuc => FanucFault::ALL.iter().map(|fault| fault.name()).collect(),
        WireProtocol::Yaskawa => YaskawaFault::ALL.iter().map(|fault| fault.name()).collect(),
        WireProtocol::Kuka => KukaFault::ALL.iter().map(|fault| fault.name()).collect(),
        WireProtocol::Abb => AbbFault::ALL.iter().map(|fault| fault.name()).collect(),
        WireProtocol::Rtde => RtdeFault::ALL.iter().map(|fault| fault.name()).collect(),
        WireProtocol::Ascii => AsciiFault::ALL.iter().map(|fault| fault.name()).collect(),
        WireProtocol::Geocom => GeocomFault::ALL.iter().map(|fault| fault.name()).collect(),
        WireProtocol::Ndi => NdiFault::ALL.iter().map(|fault| fault.name()).collect(),
    }
}

fn faults(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

impl Bench {
    /// With faults of the instrument, and of the robot if there is one.
    fn with(
        protocol: WireProtocol,
        endpoint: &Endpoint,
        of_instrument: &[&str],
        of_robot: Option<&[&str]>,
        log: Option<&RawLog>,
    ) -> Self {
        let stage = Stage::new();
        let stop = Arc::new(AtomicBool::new(false));
        let wire = |protocol: WireProtocol, endpoint: &Endpoint, names: &[&str], speedup| {
            let address = serve(protocol, &faults(names), endpoint, stage.clone(), Speedup(speedup), &stop).unwrap();
            let address: WireAddress = address.parse().unwrap();
            Wire::start(address, quick(protocol), log.cloned()).unwrap()
        };
        let instrument = wire(protocol, endpoint, of_instrument, 20);
        let robot = of_robot.map(|names| wire(WireProtocol::Rtde, &Endpoint::Loopback, names, 1));
        Self::over(protocol, instrument, robot, stage, stop)
    }

    /// With a robot of this protocol.
    fn with_robot(robot: WireProtocol, faults_of_robot: &[&str]) -> Self {
        let stage = Stage::new();
        let stop = Arc::new(AtomicBool::new(false));
        let wire = |protocol: WireProtocol, names: &[&str], speedup| {
            let served = serve(protocol, &faults(names), &Endpoint::Loopback, stage.clone(), Speedup(speedup), &stop);
            Wire::start(served.unwrap().parse().unwrap(), quick(protocol), None).unwrap()
        };
        let (instrument, robot) = (wire(WireProtocol::Emscon, &[], 20), wire(robot, faults_of_robot, 1));
        Self::over(WireProtocol::Emscon, instrument, Some(robot), stage, stop)
    }

    fn over(
        protocol: WireProtocol,
        instrument: Wire,
        robot: Option<Wire>,
        stage: Stage,
        stop: Arc<AtomicBool>,
    ) -> Self {
        let wired = Wired::over(protocol.to_string(), instrument, robot).simulated(Box::new(|| ()));
        Self { stage, wired, stop }
    }

    fn tcp(protocol: WireProtocol, of_instrument: &[&str]) -> Self {
        Self::with(protocol, &Endpoint::Loopback, of_instrument, None, None)
    }

    /// One shot. A point is one that was taken for it, or the test fails.
    fn measure(&mut self) -> Result<Reading, LinkError> {
        let before = self.stage.shots();
        let reading = self.wired.measure(&request(1), &|| true)?;
        let taken = before + 1..=self.stage.shots();
        let is_right = |shot: u32| (Stage::point(shot) - reading.point).norm() < 1e-6;
        assert!(taken.clone().any(is_right), "{:?} is none of the shots {taken:?}", reading.point);
        Ok(reading)
    }

    /// Waits until something has happened.
    fn until(&mut self, what: impl Fn(&LinkEvent) -> bool) {
        let end = Instant::now() + DEADLINE;
        let mut seen = String::new();
        while Instant::now() < end {
            let (_, news) = self.wired.watch(Duration::from_millis(20)).unwrap();
            for one in news {
                writeln!(seen, "{one:?}").unwrap();
                if what(&one) {
                    return;
                }
            }
        }
        panic!("it has not happened: {seen}");
    }

    /// Measures until it works again; what it said until then.
    fn recover(&mut self) -> Vec<String> {
        let end = Instant::now() + DEADLINE;
        let mut said = Vec::new();
        loop {
            match self.measure() {
                Ok(_) => return said,
                Err(error) => said.push(error.to_string()),
            }
            assert!(Instant::now() < end, "it does not recover: {said:?}");
            drop(self.wired.watch(Duration::from_millis(50)));
        }
    }
}

fn request(shots: u32) -> MeasureRequest {
    MeasureRequest {
        number: 1,
        pose: "1".to_owned(),
        target: 0,
        configuration: vec![0.0; 6],
        following: None,
        settle: 0.0,
        shots,
    }
}

#[test]
fn every_fault_of_every_simulator_is_in_the_document() {
    let document = include_str!("../../docs/links.md");
    for protocol in WireProtocol::ALL {
        for name in fault_names(protocol) {
            assert!(document.contains(&format!("| `{name}` |")), "{protocol}: {name}");
        }
    }
}
