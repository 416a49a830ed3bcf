//! A real viewer, if there is one: every tab on both timelines, without an error badge and without an empty panel.
//!
//! `TRUPOSE_VIEWER` names the viewer's program, the one that the command `rerun` starts.

use std::env;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};

use super::live::free_port;
use super::running::{plain, recorded};
use crate::support::skip;

/// What a panel shows that has nothing to show, and the button of its errors.
const BAD: [&str; 3] = ["View errors", "(empty)", "does not exist on the entity"];

/// A viewer without a screen and the program that drives it.
struct Viewer {
    children: [Child; 2],
    to: ChildStdin,
    from: BufReader<ChildStdout>,
}

impl Viewer {
    fn open(program: &str, file: &Path) -> Self {
        let port = free_port().to_string();
        let run = |arguments: &[&str]| {
            let mut command = Command::new(program);
            command.args(arguments).env("RUST_LOG", "error").stderr(Stdio::null());
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap()
        };
        let options = ["--headless", "--window-size", "1280x800", "--bind", "127.0.0.1", "--port", &port];
        let shown = run(&[&[file.to_str().unwrap()], &options[..]].concat());
        let mut control = run(&["viewer-mcp"]);
        let (to, from) = (control.stdin.take().unwrap(), BufReader::new(control.stdout.take().unwrap()));
        let mut viewer = Self { children: [shown, control], to, from };
        let client = json!({ "name": "trupose", "version": "1" });
        viewer.ask("initialize", &json!({ "protocolVersion": "2024-11-05", "capabilities": {}, "clientInfo": client }));
        writeln!(viewer.to, "{}", json!({ "jsonrpc": "2.0", "method": "notifications/initialized" })).unwrap();
        let endpoint = json!({ "endpoint": format!("http://127.0.0.1:{port}") });
        let is_there = |viewer: &mut Self| {
            thread::sleep(Duration::from_secs(1));
            viewer.tool("connect", &endpoint).is_some()
        };
        assert!((0..20).any(|_| is_there(&mut viewer)), "the viewer does not answer");
        viewer
    }

    fn ask(&mut self, method: &str, params: &Value) -> Value {
        let request = json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params });
        writeln!(self.to, "{request}").unwrap();
        let mut line = String::new();
        assert!(self.from.read_line(&mut line).unwrap() > 0, "the viewer's control has ended");
        serde_json::from_str(&line).unwrap()
    }

    /// The text that a tool answers; none if it fails.
    fn tool(&mut self, name: &str, arguments: &Value) -> Option<String> {
        let answer = self.ask("tools/call", &json!({ "name": name, "arguments": arguments }));
        let is_error = answer["result"]["isError"].as_bool() == Some(true) || answer["result"].is_null();
        (!is_error).then(|| answer["result"]["content"][0]["text"].as_str().unwrap_or_default().to_owned())
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        for child in &mut self.children {
            drop(child.kill());
            drop(child.wait());
        }
    }
}

#[test]
fn no_panel_is_empty_or_has_errors_in_a_viewer() {
    let Ok(program) = env::var("TRUPOSE_VIEWER") else {
        skip("no viewer: TRUPOSE_VIEWER does not name one");
        return;
    };
    let place = recorded(&plain());
    let mut viewer = Viewer::open(&program, &place.recording());
    thread::sleep(Duration::from_secs(2));
    let state: Value = serde_json::from_str(&viewer.tool("viewer_state", &json!({})).unwrap()).unwrap();
    let timelines = state["recordings"][0]["timelines"].as_array().unwrap().clone();
    assert_eq!(timelines.len(), 2, "{state}");
    // The others are shown from the beginning, or their names are in other texts, too.
    let tabs = ["What is left", "Position error", "Parameters", "All pairs", "Report", "How to"];
    let look = |viewer: &mut Viewer, what: &str| {
        thread::sleep(Duration::from_millis(300));
        let shown = viewer.tool("query_tree", &json!({ "content_contains": "" })).unwrap();
        assert_eq!(BAD.into_iter().find(|bad| shown.contains(bad)), None, "{what}");
    };
    look(&mut viewer, "as it opens");
    for timeline in timelines {
        let (low, high) = (timeline["min"].as_i64().unwrap(), timeline["max"].as_i64().unwrap());
        for time in [low, i64::midpoint(low, high), high] {
            viewer.tool("set_time", &json!({ "timeline": timeline["timeline"], "time": time })).unwrap();
            for tab in tabs {
                viewer.tool("click", &json!({ "content_contains": tab, "role": "Button" })).unwrap();
                look(&mut viewer, &format!("{tab}, {timeline} at {time}"));
            }
        }
    }
}
