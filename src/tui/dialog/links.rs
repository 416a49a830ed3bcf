//! Links from lists: what is known is chosen, and what is not known is asked for in parts. Addresses as text stay possible.

use super::{Chosen, Dialog, Form, ask};
use crate::session::set_up::InstrumentChoice;
use crate::session::simulation::{SimulatedWire, Simulation};
use crate::session::wire::{LinkChoice, Route, SerialPortName, TEXT_FORMS, WireAddress, WireProtocol};
use crate::tui::form::ChoiceList;
use crate::wizard::Intent;
use crate::wizard::view::InstrumentView;

/// How a link reaches the other end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reach {
    /// This program connects.
    Connect,
    /// The other end connects to this program.
    Wait,
    /// The other end sends datagrams.
    Datagrams,
}

/// Instruments on the network, in words.
const INSTRUMENTS: &[&str] =
    &["Leica tracker", "total station", "NDI camera", "text, connect", "text, wait for it", "text, datagrams"];
const INSTRUMENT_LINKS: [(WireProtocol, Reach); 6] = [
    (WireProtocol::Emscon, Reach::Connect),
    (WireProtocol::Geocom, Reach::Connect),
    (WireProtocol::Ndi, Reach::Connect),
    (WireProtocol::Ascii, Reach::Connect),
    (WireProtocol::Ascii, Reach::Wait),
    (WireProtocol::Ascii, Reach::Datagrams),
];

/// Instruments on a serial line, in words.
const SERIAL_INSTRUMENTS: &[&str] = &["total station", "NDI camera", "lines of text"];
const SERIAL_PROTOCOLS: [WireProtocol; 3] = [WireProtocol::Geocom, WireProtocol::Ndi, WireProtocol::Ascii];
const SPEEDS: &[&str] = &["9600", "19200", "38400", "57600", "115200"];

/// Robot controllers, in words; the first is none.
const ROBOTS: &[&str] = &[
    "none",
    "Universal Robots",
    "ABB",
    "KUKA",
    "FANUC",
    "Yaskawa",
    "text, connect",
    "text, wait for it",
    "text, datagrams",
];
const ROBOT_LINKS: [(WireProtocol, Reach); 8] = [
    (WireProtocol::Rtde, Reach::Connect),
    (WireProtocol::Abb, Reach::Connect),
    (WireProtocol::Kuka, Reach::Connect),
    (WireProtocol::Fanuc, Reach::Connect),
    (WireProtocol::Yaskawa, Reach::Connect),
    (WireProtocol::Joints, Reach::Connect),
    (WireProtocol::Joints, Reach::Wait),
    (WireProtocol::Joints, Reach::Datagrams),
];
const AUTOMATIC: &[&str] = &["no", "yes"];

const ABOUT_ROBOT: &str = "Left/Right. The controller if it reports its joint angles: they then count instead of the planned ones, and the pose is recognised.";
const ABOUT_ROBOT_ADDRESS: &str = "IP address or name, with :PORT if it is not the usual one. For text that is waited for: the port on this computer.";
const ABOUT_AUTOMATIC: &str =
    "Left/Right. yes: as soon as the SMR has been at rest for 2 s near its predicted position.";
const ABOUT_FORM: &str = "Left/Right. Only for lines of text: how the other program writes a point.";

/// Asks what is connected: known links first, then each kind of link, then rehearsals, and an address as text last.
pub fn links(content: &InstrumentView) -> Dialog {
    let InstrumentView { link, known, .. } = content;
    let mut choices: Vec<(String, Chosen)> = Vec::new();
    let linked =
        |choice: &LinkChoice| Chosen::Intent(Intent::ChooseInstrument(InstrumentChoice::Linked(choice.clone())));
    if let Some(choice) = link {
        choices.push((format!("as the profile says: {}", words(choice)), linked(choice)));
    }
    for choice in known.recent.iter().filter(|choice| Some(*choice) != link.as_ref()) {
        choices.push((format!("used before: {}", words(choice)), linked(choice)));
    }
    let proposed = link.as_ref().or_else(|| known.recent.first()).cloned().unwrap_or_default();
    for (at, title) in [
        (0, "Leica laser tracker on the network (emScon) ..."),
        (1, "total station on the network (GeoCOM) ..."),
        (2, "NDI camera on the network ..."),
        (4, "another tracker through a program that connects here (lines of text) ..."),
        (3, "another tracker through a program to connect to (lines of text) ..."),
    ] {
        choices.push((title.to_owned(), Chosen::Dialog(Box::new(network(at, &proposed)))));
    }
    for port in &known.ports {
        let title = format!("on the serial port {} ...", port_words(port));
        choices.push((title, Chosen::Dialog(Box::new(serial(port, &proposed)))));
    }
    for (title, wires) in rehearsals() {
        let simulation = Simulation { wires, ..Simulation::default() };
        let intent = Intent::ChooseInstrument(InstrumentChoice::Simulated(simulation));
        choices.push((title.to_owned(), Chosen::Intent(intent)));
    }
    let again =
        if known.ports.is_empty() { "no serial port is found: look again" } else { "look for serial ports again" };
    choices.push((again.to_owned(), Chosen::Intent(Intent::FindLinks)));
    choices.push(("an address as text ...".to_owned(), Chosen::Dialog(Box::new(ask::linked(link.as_ref())))));
    let (labels, then) = choices.into_iter().unzip();
    Dialog::Menu { list: ChoiceList::new("What measures, and how is it connected?", labels, 0), then }
}

/// Rehearsals over wires that this program serves itself.
fn rehearsals() -> [(&'static str, Vec<SimulatedWire>); 4] {
    let tcp = |protocols: &[WireProtocol]| protocols.iter().copied().map(SimulatedWire::Tcp).collect();
    [
        ("rehearse: a simulated Leica tracker and UR controller", tcp(&[WireProtocol::Emscon, WireProtocol::Rtde])),
        ("rehearse: a simulated Leica tracker, no robot link", tcp(&[WireProtocol::Emscon])),
        ("rehearse: a simulated total station", tcp(&[WireProtocol::Geocom])),
        ("rehearse: simulated lines of text", tcp(&[WireProtocol::Ascii])),
    ]
}

/// A link in words.
fn words(choice: &LinkChoice) -> String {
    let title = |text: &str| text.parse::<WireAddress>().map_or_else(|_| text.to_owned(), |address| place(&address));
    let robot = choice.robot.as_deref().map_or_else(String::new, |robot| format!(", robot {}", title(robot)));
    let automatic = if choice.is_automatic { ", automatic" } else { "" };
    format!("{}{robot}{automatic}", title(&choice.address))
}

/// An address without what goes without saying.
fn place(address: &WireAddress) -> String {
    let usual = address.protocol.usual_port();
    match &address.route {
        Route::Tcp { host, port } | Route::Ask { host, port } if Some(*port) == usual => {
            format!("{} {host}", address.protocol)
        }
        Route::Tcp { host, port } | Route::Ask { host, port } => format!("{} {host}:{port}", address.protocol),
        Route::Listen { port, .. } => format!("{} from port {port}", address.protocol),
        Route::Udp { host, port } => format!("{} {host}:{port} (UDP)", address.protocol),
        Route::Serial { device, speed } => format!("{} {device} at {speed} baud", address.protocol),
    }
}

fn port_words(port: &SerialPortName) -> String {
    match port.description.as_str() {
        "" => port.device.clone(),
        description => format!("{} ({description})", port.device),
    }
}

/// The last part of an address for its field: the host, or the port that is waited at.
fn proposed_place(address: Option<WireAddress>) -> (String, String) {
    match address {
        Some(WireAddress { route: Route::Tcp { host, port } | Route::Ask { host, port }, protocol }) => {
            let port = if protocol.usual_port() == Some(port) { String::new() } else { port.to_string() };
            (host, port)
        }
        Some(WireAddress { route: Route::Listen { port, .. } | Route::Udp { port, .. }, .. }) => {
            (String::new(), port.to_string())
        }
        Some(WireAddress { route: Route::Serial { .. }, .. }) | None => (String::new(), String::new()),
    }
}

/// Asks for an instrument on the network.
fn network(at: usize, proposed: &LinkChoice) -> Dialog {
    let own = INSTRUMENT_LINKS.get(at).map(|(protocol, _)| *protocol);
    let before = proposed.address.parse::<WireAddress>().ok().filter(|address| Some(address.protocol) == own);
    let (host, port) = proposed_place(before);
    let form = Form::new("An instrument on the network", networked)
        .pick("instrument", INSTRUMENTS, at, "Left/Right. text: another program writes the points as lines of text; see docs/bridges.md for such programs.")
        .text("IP address or name", &host, "Of the instrument's controller, such as 192.168.0.1. Empty where it connects here.")
        .text("port", &port, "Empty: the usual one. Total stations and text have none.")
        .pick("form of the lines", TEXT_FORMS, usize::from(at != 3), ABOUT_FORM);
    Dialog::Form(with_robot(form, proposed))
}

/// Asks for an instrument on a serial port.
fn serial(port: &SerialPortName, proposed: &LinkChoice) -> Dialog {
    let form = Form::new(format!("On the serial port {}", port_words(port)), on_serial_port)
        .pick("instrument", SERIAL_INSTRUMENTS, 0, "Left/Right. What is at the other end.")
        .text("serial port", &port.device, "Found on this computer.")
        .pick(
            "speed (baud)",
            SPEEDS,
            0,
            "Left/Right. As set at the instrument; NDI cameras start with 9600 and are set to the speed chosen.",
        )
        .pick("form of the lines", TEXT_FORMS, 2, ABOUT_FORM);
    Dialog::Form(with_robot(form, proposed))
}

/// Adds the fields of the robot's controller and of automatic measuring.
fn with_robot(form: Form, proposed: &LinkChoice) -> Form {
    let robot = proposed.robot.as_deref().and_then(|robot| WireAddress::of_robot(robot).ok());
    let at = robot.as_ref().and_then(|robot| {
        let reach = match robot.route {
            Route::Tcp { .. } | Route::Ask { .. } | Route::Serial { .. } => Reach::Connect,
            Route::Listen { .. } => Reach::Wait,
            Route::Udp { .. } => Reach::Datagrams,
        };
        let is_usual = robot.protocol != WireProtocol::Joints || reach == Reach::Connect;
        ROBOT_LINKS.iter().position(|(protocol, own)| {
            *protocol == robot.protocol && (*own == reach || (is_usual && *own == Reach::Connect))
        })
    });
    let (host, port) = proposed_place(robot);
    let address = match (host.as_str(), port.as_str()) {
        (host, "") => host.to_owned(),
        ("", port) => port.to_owned(),
        (host, port) => format!("{host}:{port}"),
    };
    form.pick("robot controller", ROBOTS, at.map_or(0, |at| at + 1), ABOUT_ROBOT)
        .text("its address", &address, ABOUT_ROBOT_ADDRESS)
        .text(
            "its options",
            proposed.robot_options.as_deref().unwrap_or_default(),
            "Usually empty. Yaskawa: (pulses_per_degree: [1000.0, ...]) unless the profile of the robot states them.",
        )
        .pick("automatic measuring", AUTOMATIC, usize::from(proposed.is_automatic), ABOUT_AUTOMATIC)
}

/// The address of a link from its parts.
fn address((protocol, reach): (WireProtocol, Reach), host: &str, port: &str) -> Result<WireAddress, String> {
    let port_at_end = if port.is_empty() { host } else { port };
    match reach {
        Reach::Connect if host.is_empty() => Err("the IP address or name is missing".to_owned()),
        Reach::Connect if port.is_empty() => format!("{protocol}:{host}").parse(),
        Reach::Connect => format!("{protocol}:{host}:{port}").parse(),
        Reach::Wait | Reach::Datagrams if port_at_end.is_empty() => {
            Err("the port on this computer is missing, such as 5000".to_owned())
        }
        Reach::Wait => format!("{protocol}:listen:0.0.0.0:{port_at_end}").parse(),
        Reach::Datagrams => format!("{protocol}:udp:0.0.0.0:{port_at_end}").parse(),
    }
}

/// The choice with the fields of [`with_robot`].
fn choice(instrument: &WireAddress, form: &str, rest: &[String]) -> Result<Intent, String> {
    let [robot, robot_address, robot_options, automatic] = rest else {
        return Err("four values about the robot are needed".to_owned());
    };
    let link = ROBOTS.iter().position(|name| *name == robot).and_then(|at| ROBOT_LINKS.get(at.checked_sub(1)?));
    let robot = match link {
        None if !robot_address.is_empty() => return Err("choose which robot controller is at this address".to_owned()),
        None => None,
        Some(link) => {
            Some(address(*link, robot_address, "").map_err(|error| format!("the robot: {error}"))?.to_string())
        }
    };
    let is_text = instrument.protocol == WireProtocol::Ascii;
    Ok(Intent::ChooseInstrument(InstrumentChoice::Linked(LinkChoice {
        address: instrument.to_string(),
        options: is_text.then(|| form.to_owned()),
        robot_options: (robot.is_some() && !robot_options.is_empty()).then(|| robot_options.clone()),
        robot,
        is_automatic: automatic == "yes",
    })))
}

fn networked(values: &[String]) -> Result<Intent, String> {
    let [instrument, host, port, form, rest @ ..] = values else { return Err("eight values are needed".to_owned()) };
    let at = INSTRUMENTS.iter().position(|name| *name == instrument).unwrap_or(0);
    let link = INSTRUMENT_LINKS.get(at).copied().ok_or("choose an instrument")?;
    choice(&address(link, host, port)?, form, rest)
}

fn on_serial_port(values: &[String]) -> Result<Intent, String> {
    let [instrument, device, speed, form, rest @ ..] = values else { return Err("eight values are needed".to_owned()) };
    let at = SERIAL_INSTRUMENTS.iter().position(|name| *name == instrument).unwrap_or(0);
    let protocol = SERIAL_PROTOCOLS.get(at).copied().ok_or("choose an instrument")?;
    choice(&format!("{protocol}:serial:{device}:{speed}").parse()?, form, rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::wire::KnownLinks;

    fn values(texts: &[&str]) -> Vec<String> {
        texts.iter().map(|text| (*text).to_owned()).collect()
    }

    fn linked(intent: Result<Intent, String>) -> LinkChoice {
        match intent {
            Ok(Intent::ChooseInstrument(InstrumentChoice::Linked(choice))) => choice,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn links_are_made_of_parts() {
        let tracker =
            networked(&values(&["Leica tracker", "10.0.0.2", "", "xyz", "Universal Robots", "10.0.0.3", "", "yes"]));
        let tracker = linked(tracker);
        assert_eq!((tracker.address.as_str(), tracker.options.as_deref()), ("emscon:tcp:10.0.0.2:700", None));
        assert_eq!((tracker.robot.as_deref(), tracker.is_automatic), (Some("rtde:tcp:10.0.0.3:30004"), true));
        let text = linked(networked(&values(&[
            "text, wait for it",
            "",
            "5000",
            "bridge",
            "text, datagrams",
            "5001",
            "",
            "no",
        ])));
        assert_eq!((text.address.as_str(), text.options.as_deref()), ("ascii:listen:0.0.0.0:5000", Some("bridge")));
        assert_eq!(text.robot.as_deref(), Some("joints:udp:0.0.0.0:5001"));
        let serial =
            linked(on_serial_port(&values(&["total station", "/dev/ttyUSB0", "115200", "xyz", "none", "", "x", "no"])));
        assert_eq!((serial.address.as_str(), serial.robot), ("geocom:serial:/dev/ttyUSB0:115200", None));
        assert_eq!(serial.robot_options, None);
        for (texts, part) in [
            (["Leica tracker", "", "", "xyz", "none", "", "", "no"], "IP address"),
            (["total station", "10.0.0.2", "", "xyz", "none", "", "", "no"], "the port is missing"),
            (["text, wait for it", "", "", "xyz", "none", "", "", "no"], "port on this computer"),
            (["Leica tracker", "10.0.0.2", "", "xyz", "none", "10.0.0.3", "", "no"], "choose which robot"),
            (["Leica tracker", "10.0.0.2", "", "xyz", "KUKA", "", "", "no"], "the robot: the IP"),
        ] {
            let error = networked(&values(&texts)).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn a_link_of_the_past_fills_the_form_again() {
        for address in ["emscon:tcp:10.0.0.2:700", "geocom:tcp:10.0.0.2:1212", "ndi:tcp:10.0.0.2:8765"] {
            for robot in [
                "rtde:tcp:10.0.0.3:30004",
                "kuka:tcp:10.0.0.3:7001",
                "joints:listen:0.0.0.0:5001",
                "joints:udp:0.0.0.0:5001",
                "yaskawa:udp:10.0.0.3:10040",
                "fanuc:tcp:10.0.0.3:16001",
                "abb:tcp:10.0.0.3:80",
            ] {
                let before = LinkChoice {
                    address: address.to_owned(),
                    robot: Some(robot.to_owned()),
                    robot_options: Some("(a: 1)".to_owned()),
                    is_automatic: true,
                    ..LinkChoice::default()
                };
                let at =
                    INSTRUMENT_LINKS.iter().position(|(protocol, _)| address.starts_with(protocol.name())).unwrap();
                let Dialog::Form(form) = network(at, &before) else { panic!() };
                assert_eq!(linked(form.value()), before);
            }
        }
    }

    #[test]
    fn the_list_has_what_is_known_first_and_a_text_last() {
        let before = LinkChoice { address: "emscon:tcp:10.0.0.2:700".to_owned(), ..LinkChoice::default() };
        let of_profile = LinkChoice { robot: Some("rtde:tcp:10.0.0.3:30004".to_owned()), ..before.clone() };
        let port = SerialPortName { device: "/dev/ttyUSB0".to_owned(), description: "FTDI".to_owned() };
        let content = InstrumentView {
            link: Some(of_profile.clone()),
            known: KnownLinks { recent: vec![before.clone(), of_profile.clone()], ports: vec![port] },
            choice: None,
            identity: None,
            recorded_poses: 0,
            stated_sigma: None,
            cell: None,
        };
        let Dialog::Menu { list, then } = links(&content) else { panic!() };
        let question = list.question();
        assert!(question[1].ends_with("as the profile says: emscon 10.0.0.2, robot rtde 10.0.0.3"), "{question:?}");
        assert!(question[2].ends_with("used before: emscon 10.0.0.2"), "{question:?}");
        assert!(question.iter().any(|line| line.ends_with("on the serial port /dev/ttyUSB0 (FTDI) ...")));
        assert_eq!(question.iter().filter(|line| line.contains("used before")).count(), 1);
        let Chosen::Intent(first) = &then[0] else { panic!() };
        assert_eq!(*first, Intent::ChooseInstrument(InstrumentChoice::Linked(of_profile)));
        assert!(matches!(then.last(), Some(Chosen::Dialog(_))));
    }
}
