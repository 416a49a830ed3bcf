//! Time to read and to rewrite a program of 5 MB in each language, on one core.
//!
//! `cargo bench --bench programs`, or with `--profile dev`.

#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "a benchmark stops when its case is broken; it measures time, and prints"
)]

use std::time::Instant;

use trupose::profile::{Profile, builtin};
use trupose::program::motion::{Command, Companion, Goal, ReadOptions};
use trupose::program::rewrite::{rewrite, scan};
use trupose::program::{Dialect, Robot};

/// Size of each program (bytes).
const SIZE: usize = 5_000_000;

/// Longest time for reading and rewriting together (s).
const LIMIT: f64 = 2.0;

/// Lines of a program: a head, a body that repeats for each target, moves, and an end.
struct Case {
    dialect: Dialect,
    arm: &'static str,
    head: &'static str,
    /// `@` is the number of the target.
    target: &'static str,
    middle: &'static str,
    motion: &'static str,
    end: &'static str,
}

const CASES: &[Case] = &[
    Case {
        dialect: Dialect::Rapid,
        arm: "abb_irb120",
        head: "MODULE M\n",
        target: "CONST robtarget p@:=[[400.123,20.5,500],[0,0.70710678,0.70710678,0],[0,-1,0,1],[9E9,9E9,9E9,9E9,9E9,9E9]];\n",
        middle: "PROC main()\n",
        motion: "MoveL p@,v100,z10,tool0;\n",
        end: "ENDPROC\nENDMODULE\n",
    },
    Case {
        dialect: Dialect::Krl,
        arm: "kuka_kr6_r900",
        head: "DEF x()\n$TOOL=TOOL_DATA[1]\n",
        target: "LIN {X 400.123,Y 2.5,Z 300,A 0,B 90,C 0,E1 0.0} C_VEL ; @\n",
        middle: "",
        motion: "",
        end: "END\n",
    },
    Case {
        dialect: Dialect::Fanuc,
        arm: "fanuc_lrmate200id",
        head: "/POS\n",
        target: "P[@]{\n   GP1:\n\tUF : 1, UT : 2,\t\tCONFIG : 'N U T, 0, 0, 0',\n\tX =   400.123  mm,\tY =     1.500  mm,\tZ =   300.000  mm,\n\tW =   180.000 deg,\tP =     0.000 deg,\tR =     0.000 deg\n};\n",
        middle: "/MN\n",
        motion: "   1:L P[@] 100mm/sec CNT50 ;\n",
        end: "/END\n",
    },
    Case {
        dialect: Dialect::Urscript,
        arm: "ur5e",
        head: "def p():\n",
        target: "  movel(p[0.14412, -.436, .202, -.0012, 3.116, .0389], a=1.2, v=0.25) # @\n",
        middle: "",
        motion: "",
        end: "end\n",
    },
    Case {
        dialect: Dialect::Val3,
        arm: "staubli_tx2_60",
        head: "<Data name=\"p\" type=\"pointRx\">\n",
        target: "<Value key=\"@\" x=\"400.123\" ry=\"180\" shoulder=\"righty\" elbow=\"epositive\" fatherId=\"fPart[0]\" />\n",
        middle: "</Data><Code><![CDATA[\n",
        motion: "movel(p[@], tGrip, mNom)\n",
        end: "]]></Code>\n",
    },
    Case {
        dialect: Dialect::Inform,
        arm: "soochow",
        head: "//POS\n///TOOL 1\n///POSTYPE ROBOT\n///RECTAN\n///RCONF 1,0,0,0,0,0\n",
        target: "C@=400.123,10.000,300.000,180.0000,0.0000,0.0000\n",
        middle: "//INST\n",
        motion: "MOVL C@ V=100.0\n",
        end: "END\n",
    },
    Case {
        dialect: Dialect::Ros,
        arm: "franka_panda",
        head: "joint_names: [panda_joint1, panda_joint2, panda_joint3, panda_joint4, panda_joint5, panda_joint6, panda_joint7]\npoints:\n",
        target: "- positions: [0.123456, -0.5, 0.0, -2.0, 0.0, 1.6, 0.8]\n  time_from_start: {sec: @, nanosec: 0}\n",
        middle: "",
        motion: "",
        end: "",
    },
];

fn measure(case: &Case) {
    let count = SIZE / (case.target.len() + case.motion.len() + 8);
    let lines = |line: &str| (0..count).map(|number| line.replace('@', &number.to_string())).collect::<String>();
    let targets = lines(case.target);
    let text = [case.head, &targets, case.middle, &lines(case.motion), case.end].concat();
    let profile = Profile::parse(builtin(case.arm).unwrap(), case.arm).unwrap().0;
    let robot = Robot {
        profile: profile.name(),
        chain: profile.chain(),
        max_speeds: &[],
        pulses_per_degree: &[],
        joint_aliases: profile.joint_aliases(),
    };
    let options = ReadOptions { companions: Vec::<Companion>::new(), ..ReadOptions::default() };
    let begin = Instant::now();
    let found = scan(case.dialect, &robot, &options, text.as_bytes()).unwrap();
    let reading = begin.elapsed().as_secs_f64();
    let command = |goal: &Goal| match goal {
        Goal::Joints(joints) => Command::Joints(joints.iter().map(|q| q + 1e-4).collect()),
        Goal::Pose(pose) => Command::Pose(pose.frame_from_tool),
    };
    let commands: Vec<_> = found.targets.iter().map(|target| Some(command(&target.goal))).collect();
    let written = rewrite(case.dialect, &robot, text.as_bytes(), &found, &commands).unwrap();
    let all = begin.elapsed().as_secs_f64();
    let megabytes = text.len() as f64 / 1e6;
    println!(
        "{}: {megabytes:.1} MB, {} targets: read in {reading:.2} s, rewritten ({:.1} MB) in {:.2} s",
        case.dialect.name(),
        found.targets.len(),
        written.len() as f64 / 1e6,
        all - reading
    );
    assert_eq!(found.targets.len(), count);
    assert!(all < LIMIT, "slower than {LIMIT} s");
}

fn main() {
    CASES.iter().for_each(measure);
}
