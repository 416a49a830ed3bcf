//! Arguments of the command line.

mod identity;
mod import;
mod link;
mod payload;
mod profile;
mod recording;
mod session;
mod shell;
mod terminal;

pub mod check;
pub mod compare;
pub mod compensate;
pub mod iso9283;

use std::error::Error;
use std::ffi::OsString;
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, CommandFactory as _, Parser, Subcommand};
use nalgebra::Point3;

use crate::identification::{Estimator, Prior, Settings, TermGroup, Weighting};
use crate::planning::order::Pace;
use crate::planning::{BoxInBase, Objective};
use crate::procedure::plan::PlanRequest;
use crate::profile::{ExpectedDeviation, Level};
use crate::program::{Dialect, MAX_SPEED};
use crate::session::summary::Refit;
use crate::units::{from_mm, to_mm};

pub use identity::IdentityArgs;
pub use import::ImportArgs;
use link::wires;
pub use link::{LinkCommand, LinkTestArgs, SimulateArgs, Wires};
pub use payload::PayloadArgs;
use profile::NEW_EXAMPLES;
pub use profile::NewProfileArgs;
pub use recording::{RecordArgs, RecordCommand, RecordingArgs};
pub use session::SessionCommand;
pub use shell::{CompletionsArgs, ManArgs};
pub use terminal::{ColorArg, TerminalArgs, TerminalEnvironment};

/// The help of the program: commands by purpose, and examples.
const HELP: &str = "\
{about-with-newline}
{usage-heading} {usage}

Guided calibration:
  wizard       Guided calibration in the terminal; the same as no command at all
  resume       Continue a session where it ended
  demo         Calibrate a simulated robot, without a terminal
  replay       Step through a session, entry by entry, without changing it
  session      List, show or export sessions

Step by step:
  profile      List, show, write or check robot profiles
  plan         Plan which poses to measure, and in which order
  program      Write a robot program that visits the poses of a plan
  import       Read measured points from tables of other programs
  identify     Identify the kinematic errors of a robot from measured points
  constraints  The same from direct distances, without coordinates
  verify       Verify a calibration on other measured points
  iso9283      Accuracy and repeatability with the definitions of ISO 9283
  check        Say in ten minutes whether a calibration still holds
  compare      Compare calibrations of one arm, or of sister arms

Apply the result:
  compensate   Correct targets or programs so that the real arm reaches them
  export       Write the identified arm as a profile, URDF or table

Instruments and recordings:
  link         Test the link to an instrument
  simulate     Simulate an instrument or a robot's controller on a wire
  record       Make recordings for the 3D viewer again

Shell:
  completions  Print the completions of a shell
  man          Print the manual page, or write the pages of all commands
  help         Print the help of a command

Options:
{options}

Examples:
  trupose                                      start or continue a calibration
  trupose demo                                 see one, simulated
  trupose plan --profile ur10e --out plan.csv  choose the poses for an arm
";

/// Makes an industrial arm accurate: identifies its kinematic errors from distances between measured points.
///
/// Without a command it opens the guided calibration in the terminal.
#[derive(Debug, Parser)]
#[command(name = "trupose", version, about, max_term_width = 80, args_conflicts_with_subcommands = true, help_template = HELP)]
pub struct Cli {
    /// The command; none opens the wizard.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Run a script through the wizard, without a terminal
    #[arg(long, value_name = "FILE")]
    pub script: Option<PathBuf>,
    /// Options of scripts.
    #[command(flatten)]
    pub script_args: ScriptArgs,
    /// Options of the terminal.
    #[command(flatten)]
    pub terminal: TerminalArgs,
}

impl Cli {
    /// Moves options in front of a command behind it, so that `trupose --sessions DIR resume NAME` means the same as
    /// `trupose resume NAME --sessions DIR`.
    pub fn in_order(words: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
        let mut words: Vec<OsString> = words.into_iter().collect();
        let command = Self::command();
        let takes_value = |word: &str| {
            let name = word.strip_prefix("--").filter(|name| !name.contains('='));
            let option = command.get_arguments().find(|option| option.get_long() == name);
            name.is_some() && option.is_some_and(|option| option.get_action().takes_values())
        };
        let mut at = 1;
        while let Some(word) = words.get(at).map(|word| word.to_string_lossy().into_owned()) {
            if !word.starts_with('-') || word == "--" {
                break;
            }
            at += if takes_value(&word) { 2 } else { 1 };
        }
        let is_command =
            words.get(at).is_some_and(|word| word.to_str().is_some_and(|word| command.find_subcommand(word).is_some()));
        if is_command {
            words[1..=at].rotate_right(1);
        }
        words
    }
}

/// Arguments of `wizard`.
#[derive(Args, Clone, Debug)]
pub struct WizardArgs {
    /// Robot profile to start with: a file, or the name of a shipped one ('trupose profile list')
    #[arg(long, value_name = "NAME|FILE")]
    pub profile: Option<String>,
    /// Folder for new sessions
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    pub sessions: PathBuf,
    /// Write the actions of the session as a script
    #[arg(long, value_name = "FILE")]
    pub record_script: Option<PathBuf>,
    /// Log every byte to and from instruments on a wire to this file
    #[arg(long, value_name = "FILE")]
    pub raw_log: Option<PathBuf>,
    /// Options of recordings.
    #[command(flatten)]
    pub recording: RecordingArgs,
    /// Options of the terminal.
    #[command(flatten)]
    pub terminal: TerminalArgs,
}

/// Options of scripts.
#[derive(Args, Clone, Debug)]
pub struct ScriptArgs {
    /// Value of a placeholder '${name}' of the script; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = name_and_value)]
    pub values: Vec<(String, String)>,
    /// Folder for new sessions
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    pub sessions: PathBuf,
    /// Print one JSON object per line
    #[arg(long)]
    pub json: bool,
    /// Write the actions of the session as a script
    #[arg(long, value_name = "FILE")]
    pub record_script: Option<PathBuf>,
    /// Log every byte to and from instruments on a wire to this file
    #[arg(long, value_name = "FILE")]
    pub raw_log: Option<PathBuf>,
    /// Options of recordings.
    #[command(flatten)]
    pub recording: RecordingArgs,
}

/// Arguments of `demo`.
#[derive(Args, Clone, Debug)]
pub struct DemoArgs {
    /// Seed of the simulated cell: the same seed gives the same transcript
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Connect to the simulated cell over wires: 'emscon', 'ascii', 'geocom' or 'ndi', with 'serial:' in front for a serial line where the protocol allows it; with ',rtde', ',joints', ',kuka', ',abb', ',fanuc' or ',yaskawa' the robot reports its joints
    #[arg(long, value_name = "PROTOCOL", value_parser = wires)]
    pub over: Option<Wires>,
    /// Drive the screens of the wizard at reading speed; any key takes over
    #[arg(long)]
    pub watch: bool,
    /// Options of scripts.
    #[command(flatten)]
    pub script: ScriptArgs,
    /// Options of the terminal.
    #[command(flatten)]
    pub terminal: TerminalArgs,
}

/// Arguments of `resume`.
#[derive(Args, Clone, Debug)]
pub struct ResumeArgs {
    /// Folder or name of the session, or the beginning of its name [default: the latest]
    #[arg(value_name = "DIR|NAME")]
    pub folder: Option<PathBuf>,
    /// Continue with a script, without a terminal
    #[arg(long, value_name = "FILE")]
    pub script: Option<PathBuf>,
    /// Options of scripts.
    #[command(flatten)]
    pub script_args: ScriptArgs,
    /// Options of the terminal.
    #[command(flatten)]
    pub terminal: TerminalArgs,
}

/// Arguments of `replay`.
#[derive(Args, Clone, Debug)]
pub struct ReplayArgs {
    /// Folder of the session
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Entry of the journal to start with [default: the first; with '--print' and '--csv' the last]
    #[arg(long, value_name = "N")]
    pub entry: Option<u64>,
    /// Print the entries and the points up to there, without a terminal
    #[arg(long)]
    pub print: bool,
    /// Print the measurements that count there as CSV, without a terminal
    #[arg(long, conflicts_with = "print")]
    pub csv: bool,
    /// Options of the terminal.
    #[command(flatten)]
    pub terminal: TerminalArgs,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Read measured points from tables of other programs, and show what was understood
    #[command(
        after_help = "Examples:\n  trupose import points.txt --profile ur10e --out points.csv\n  trupose import points.txt --profile ur10e --columns 'q1_deg=A1, …, x_mm=X, …' --save-layout faro --out points.csv\n  trupose import --joints joints.txt --points points.txt --units deg,mm --profile ur10e --out points.csv"
    )]
    Import(ImportArgs),
    /// Identify the kinematic errors of a robot from measured points
    #[command(after_help = "Example:\n  trupose identify --profile ur10e --measurements points.csv --out results")]
    Identify(IdentifyArgs),
    /// Verify a calibration on other measured points
    #[command(
        after_help = "Example:\n  trupose verify --calibration results/calibration.ron --measurements later.csv --refit frame+target"
    )]
    Verify(VerifyArgs),
    /// Identify from direct distances: shared points (ball and sockets) or measured lengths, no coordinates
    #[command(after_help = "Example:\n  trupose constraints --profile ur10e --measurements sockets.csv --out results")]
    Constraints(ConstraintsArgs),
    /// Plan which poses to measure, and in which order
    #[command(after_help = "Example:\n  trupose plan --profile ur10e --poses 60 --out plan.csv")]
    Plan(PlanArgs),
    /// Write a robot program that visits the poses of a plan
    #[command(
        after_help = "Example:\n  trupose program --profile ur10e --plan plan.csv --dialect urscript --out program"
    )]
    Program(ProgramArgs),
    /// Test the arm with the definitions of ISO 9283: plan the poses, evaluate the points
    #[command(
        subcommand,
        after_help = "Example:\n  trupose iso9283 plan --profile ur10e --out cube.csv\n  trupose iso9283 evaluate --profile ur10e --measurements attained.csv"
    )]
    Iso9283(iso9283::Iso9283Command),
    /// Check with a few poses whether a calibration still holds: plan the poses, evaluate the points
    #[command(
        subcommand,
        after_help = "Example:\n  trupose check plan --calibration calibration.ron --out check.csv\n  trupose check evaluate --calibration calibration.ron --measurements checked.csv"
    )]
    Check(check::CheckCommand),
    /// Compare calibrations of one arm, or of sister arms: what has changed, over the workspace
    #[command(after_help = "Example:\n  trupose compare 2025/calibration.ron 2026/calibration.ron")]
    Compare(compare::CompareArgs),
    /// Correct targets so that the real arm reaches them
    #[command(
        after_help = "Example:\n  trupose compensate --calibration calibration.ron --program part.src --dialect krl --out corrected.src"
    )]
    Compensate(compensate::CompensateArgs),
    /// Write the identified arm as a profile, URDF or table
    #[command(after_help = "Example:\n  trupose export --calibration calibration.ron --format dh-csv --out dh.csv")]
    Export(compensate::ExportArgs),
    /// Guided calibration in the terminal; the same as no command at all
    #[command(after_help = "Example:\n  trupose wizard --profile ur10e\n  trupose wizard --plain")]
    Wizard(WizardArgs),
    /// Calibrate a simulated robot from profile to result, without a terminal
    #[command(after_help = "Example:\n  trupose demo --seed 7")]
    Demo(DemoArgs),
    /// Continue a session where it ended
    #[command(after_help = "Example:\n  trupose resume\n  trupose resume ur10e-20260301")]
    Resume(ResumeArgs),
    /// Step through a session, entry by entry, without changing it
    #[command(after_help = "Example:\n  trupose replay sessions/ur10e-20260301-0915")]
    Replay(ReplayArgs),
    /// List, show or export sessions
    #[command(
        subcommand,
        after_help = "Example:\n  trupose session list\n  trupose session report --text sessions/ur10e-20260301"
    )]
    Session(SessionCommand),
    /// Make recordings for the 3D viewer again
    #[command(subcommand, after_help = "Example:\n  trupose record rebuild sessions/ur10e-20260301")]
    Record(RecordCommand),
    /// List, show, write or check robot profiles
    #[command(
        subcommand,
        after_help = "Example:\n  trupose profile show ur10e\n  trupose profile new --from ur10e --out my-arm.ron"
    )]
    Profile(ProfileCommand),
    /// Test the link to an instrument
    #[command(subcommand, after_help = "Example:\n  trupose link test emscon:192.168.0.2")]
    Link(LinkCommand),
    /// Simulate an instrument or a robot's controller on a wire
    #[command(
        after_help = "Example:\n  trupose simulate emscon --profile ur10e --plan plan.csv --listen 127.0.0.1:7000"
    )]
    Simulate(SimulateArgs),
    /// Print the completions of a shell
    #[command(after_help = "Example:\n  trupose completions bash")]
    Completions(CompletionsArgs),
    /// Print the manual page, or write the pages of all commands
    #[command(after_help = "Example:\n  trupose man --out man1")]
    Man(ManArgs),
}

/// Commands about profiles.
#[derive(Debug, Subcommand)]
pub enum ProfileCommand {
    /// List the profiles that come with the program
    List,
    /// Show a profile: geometry, limits, targets, what will be identified
    Show {
        /// Name of a shipped profile, or path of a profile file
        profile: String,
    },
    /// Check a profile and show every problem with its place
    Check {
        /// Path of the profile file, or name of a shipped profile
        file: PathBuf,
    },
    /// Write a profile for an arm that is not in the list: from another one, from a data sheet, or measured
    #[command(after_help = NEW_EXAMPLES)]
    New(Box<NewProfileArgs>),
    /// Make a profile from the serial chain of a URDF
    ImportUrdf(compensate::ImportUrdfArgs),
    /// Make a profile from the factory calibration of a Universal Robots arm
    #[command(after_help = "Example:\n  trupose profile import-ur calibration.conf --model ur10e --out my-ur10e.ron")]
    ImportUr(compensate::ImportUrArgs),
}

/// Options of the identification, shared by all commands that identify.
#[derive(Args, Clone, Debug)]
pub struct EstimationArgs {
    /// Robot profile: a file, or the name of a shipped one ('trupose profile list')
    #[arg(long, value_name = "NAME|FILE")]
    pub profile: String,
    /// Rows to identify from, such as 'pose % 17 == 0' or "position != 'left'"
    #[arg(long = "use", value_name = "CONDITION")]
    pub filter: Option<String>,
    /// Use a table although it has changed since this program wrote it, because the change was made on purpose
    #[arg(long)]
    pub edited: bool,
    /// How outliers are treated
    #[arg(long, value_enum, default_value_t)]
    pub estimator: Estimator,
    /// Assumption about deviations: those the profile expects, or nothing (the paper's minimum-norm solution)
    #[arg(long, value_enum, default_value_t)]
    pub prior: Prior,
    /// What is identified
    #[arg(long, value_enum, default_value_t)]
    pub level: Level,
    /// Errors of the joints to identify, whatever the data support, such as 'compliance,curves' [default: as '--level' says]
    #[arg(long, value_enum, value_delimiter = ',', value_name = "GROUP,…", conflicts_with = "level")]
    pub terms: Option<Vec<TermGroup>>,
    /// Largest number of solver steps; 1 is the paper's single linear step
    #[arg(long, value_name = "N", default_value_t = Settings::default().iterations, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=100_000))]
    pub iterations: usize,
    /// Standard deviation of a measured coordinate [default: of the readings, else of the profile's instrument, else estimated]
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub sigma_mm: Option<f64>,
    /// Expected deviation of every length and every angle instead of the profile's, such as '1mm,0.1deg'
    #[arg(long, value_name = "LENGTH,ANGLE")]
    pub expected_deviation: Option<ExpectedDeviation>,
    /// What the flange carried.
    #[command(flatten)]
    pub payload: PayloadArgs,
    /// Folder for the results (calibration.ron, report.html, report.json); created if it is missing
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
    /// What the report is about.
    #[command(flatten)]
    pub identity: IdentityArgs,
}

/// Arguments of `identify`.
#[derive(Args, Debug)]
pub struct IdentifyArgs {
    /// Measured points: CSV with units in the column names
    #[arg(long, value_name = "CSV")]
    pub measurements: PathBuf,
    /// Options of the identification.
    #[command(flatten)]
    pub estimation: EstimationArgs,
    /// Layout of the tables: 'named', 'robodk', 'delmia', or one that 'import' saved
    #[arg(long, value_name = "NAME", default_value = "named")]
    pub layout: String,
    /// Verify on the points of another file measured in the same set-up
    #[arg(long, value_name = "CSV", conflicts_with = "verify_rest")]
    pub verify: Option<PathBuf>,
    /// Verify on the rows that '--use' leaves out
    #[arg(long, requires = "filter")]
    pub verify_rest: bool,
    /// Weighting of the distances: with their true covariance, or all pairs alike as in the paper
    #[arg(long, value_enum, default_value_t)]
    pub weighting: Weighting,
    /// Begin with what an earlier calibration of this arm knows (calibration.ron): a few new poses are enough
    #[arg(long, value_name = "RON", conflicts_with_all = ["level", "terms", "weighting"])]
    pub from_calibration: Option<PathBuf>,
    /// The SMR is still where it was at that calibration
    #[arg(long, requires = "from_calibration")]
    pub same_smr: bool,
    /// How far every length and every angle may have drifted since, such as '0.01mm,0.001deg' [default: 0.002mm,0.0002deg]
    #[arg(long, value_name = "LENGTH,ANGLE", requires = "from_calibration")]
    pub drift: Option<ExpectedDeviation>,
    /// Options of recordings.
    #[command(flatten)]
    pub record: RecordArgs,
}

/// Arguments of `verify`.
#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// Calibration to verify (calibration.ron)
    #[arg(long, value_name = "RON")]
    pub calibration: PathBuf,
    /// Use calibration or table although it has changed since this program wrote it, because the change was made on purpose
    #[arg(long)]
    pub edited: bool,
    /// Measured points: CSV with units in the column names
    #[arg(long, value_name = "CSV")]
    pub measurements: PathBuf,
    /// Layout of the table: 'named', 'robodk', 'delmia', or one that 'import' saved
    #[arg(long, value_name = "NAME", default_value = "named")]
    pub layout: String,
    /// Rows to verify on, such as 'pose < 20'
    #[arg(long = "use", value_name = "CONDITION")]
    pub filter: Option<String>,
    /// What the flange carried.
    #[command(flatten)]
    pub payload: PayloadArgs,
    /// What to fit to these points because the set-up changed: nothing, the tracker's place, or also the SMR's mounting
    #[arg(long, value_enum, default_value_t)]
    pub refit: Refit,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `constraints`.
#[derive(Args, Debug)]
pub struct ConstraintsArgs {
    /// Shared points (position, socket, joints), lengths (from_q1_deg …, to_q1_deg …, length_mm) or contacts (feature, shape, joints, length_mm): CSV with units
    #[arg(long, value_name = "CSV")]
    pub measurements: PathBuf,
    /// Options of the identification.
    #[command(flatten)]
    pub estimation: EstimationArgs,
    /// Known distance between the two sockets of one position
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub socket_distance_mm: Option<f64>,
    /// Standard deviation of that distance
    #[arg(long, value_name = "MM", default_value_t = 0.05, value_parser = positive)]
    pub socket_distance_sigma_mm: f64,
    /// Verify on the rows that '--use' leaves out
    #[arg(long, requires = "filter", conflicts_with = "leave_one_out")]
    pub verify_rest: bool,
    /// Verify by leaving out each value of this column in turn, such as 'position'
    #[arg(long, value_name = "COLUMN", value_parser = ["position"])]
    pub leave_one_out: Option<String>,
}

/// Arguments of `plan`.
#[derive(Args, Debug)]
pub struct PlanArgs {
    /// Robot profile: a file, or the name of a shipped one ('trupose profile list')
    #[arg(long, value_name = "NAME|FILE")]
    pub profile: String,
    /// Number of new poses to identify from; those of '--include' are added
    #[arg(long, value_name = "N", default_value_t = PlanRequest::default().poses)]
    pub poses: usize,
    /// Number of poses to verify with
    #[arg(long, value_name = "N", default_value_t = PlanRequest::default().verification)]
    pub verification: usize,
    /// File for the plan
    #[arg(long, value_name = "CSV")]
    pub out: Option<PathBuf>,
    /// Repeat the first pose after every N poses to detect drift; 0: never
    #[arg(long, value_name = "N", default_value_t = PlanRequest::default().drift_every)]
    pub drift_every: usize,
    /// Percentage of the full joint speed that the program will use
    #[arg(long, value_name = "PERCENT", default_value_t = 100.0 * Pace::default().speed, value_parser = speed_percent)]
    pub speed_percent: f64,
    /// Narrow a joint, such as 'j2=-30..60' (degrees, sliding joints mm); may be repeated
    #[arg(long = "limit", value_name = "JOINT=LOW..HIGH", allow_hyphen_values = true)]
    pub limits: Vec<JointLimit>,
    /// Keep the reflector inside a box in the robot base, such as '500..1500,-800..800,200..1600' (mm, x,y,z)
    #[arg(long = "box", value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub region: Option<BoxMm>,
    /// Poses that must be included because they are already measured (any table with q1… columns and a pose column)
    #[arg(long, value_name = "CSV")]
    pub include: Option<PathBuf>,
    /// Score the poses of this plan or list instead of choosing new ones
    #[arg(long, value_name = "CSV", conflicts_with_all = ["poses", "objective", "include", "out"])]
    pub check: Option<PathBuf>,
    /// Standard deviation of a measured coordinate [default: of the profile's instrument]
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub sigma_mm: Option<f64>,
    /// Number of candidates to choose from
    #[arg(long, value_name = "N", default_value_t = PlanRequest::default().candidates, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(10..=1_000_000))]
    pub candidates: usize,
    /// What the poses are chosen for
    #[arg(long, value_enum, default_value_t)]
    pub objective: Objective,
    /// Seed of all random decisions: the same seed gives the same plan
    #[arg(long, value_name = "N", default_value_t = PlanRequest::default().seed)]
    pub seed: u64,
    /// Stop searching after this many seconds and take the best set so far
    #[arg(long, value_name = "S", value_parser = positive)]
    pub time_limit: Option<f64>,
    /// Threads to search with [default: one per core]; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=256))]
    pub threads: Option<usize>,
    /// Check joint limits only, no collisions and no line of sight
    #[arg(long)]
    pub no_filters: bool,
    /// Clearance to keep from everything
    #[arg(long, value_name = "MM", default_value_t = to_mm(PlanRequest::default().clearance), value_parser = positive)]
    pub clearance_mm: f64,
    /// Expected deviation of every length and every angle instead of the profile's, such as '1mm,0.1deg'
    #[arg(long, value_name = "LENGTH,ANGLE")]
    pub expected_deviation: Option<ExpectedDeviation>,
    /// What will be identified
    #[arg(long, value_enum, default_value_t)]
    pub level: Level,
    /// Wait before the first reading of a pose
    #[arg(long, value_name = "S", default_value_t = Pace::default().settle, value_parser = positive)]
    pub settle_s: f64,
    /// Readings per pose, one second each
    #[arg(long, value_name = "N", default_value_t = Pace::default().shots, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub shots: u32,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
    /// Options of recordings.
    #[command(flatten)]
    pub record: RecordArgs,
}

/// Arguments of `program`.
#[derive(Args, Debug)]
pub struct ProgramArgs {
    /// Robot profile: a file, or the name of a shipped one ('trupose profile list')
    #[arg(long, value_name = "NAME|FILE")]
    pub profile: String,
    /// Plan to write a program for
    #[arg(long, value_name = "CSV")]
    pub plan: PathBuf,
    /// Language of the robot controller
    #[arg(long, value_parser = one_of::<Dialect>(Dialect::NAMES), ignore_case = true)]
    pub dialect: Dialect,
    /// Name of the program
    #[arg(long, default_value = "calposes")]
    pub name: String,
    /// Wait at each pose that is measured
    #[arg(long, value_name = "S", default_value_t = Pace::default().measuring_time(), value_parser = positive)]
    pub dwell_s: f64,
    /// Wait for the operator at each pose instead of a fixed time
    #[arg(long, conflicts_with = "dwell_s")]
    pub acknowledge: bool,
    /// Percentage of the full joint speed
    #[arg(long, value_name = "PERCENT", default_value_t = 100.0 * Pace::default().speed, value_parser = speed_percent)]
    pub speed_percent: f64,
    /// Folder for the program's files [default: print them]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// `--limit`: a joint by name or number with a range in degrees or mm.
#[derive(Clone, Debug, PartialEq)]
pub struct JointLimit {
    /// Name of the joint, or `j` and its number.
    pub joint: String,
    /// Lower limit (deg or mm).
    pub low: f64,
    /// Upper limit (deg or mm).
    pub high: f64,
}

impl FromStr for JointLimit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let expected =
            || format!("'{text}' is not a limit; write for example 'j2=-30..60' (degrees, sliding joints mm)");
        let (joint, range) = text.split_once('=').ok_or_else(expected)?;
        let (low, high) = parse_range(range).ok_or_else(expected)?;
        if joint.trim().is_empty() {
            return Err(expected());
        }
        if low >= high {
            return Err(format!("in '{text}' the lower limit {low} is not below the upper limit {high}"));
        }
        Ok(Self { joint: joint.trim().to_owned(), low, high })
    }
}

/// `--box`: ranges of x, y and z (mm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxMm {
    /// Lower and upper end per axis (mm).
    pub ranges: [(f64, f64); 3],
}

impl From<BoxMm> for BoxInBase {
    fn from(space: BoxMm) -> Self {
        let [x, y, z] = space.ranges;
        Self {
            min: Point3::new(from_mm(x.0), from_mm(y.0), from_mm(z.0)),
            max: Point3::new(from_mm(x.1), from_mm(y.1), from_mm(z.1)),
        }
    }
}

impl FromStr for BoxMm {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let ranges: Option<Vec<(f64, f64)>> = text.split(',').map(parse_range).collect();
        match ranges.as_deref() {
            Some(&[x, y, z]) if [x, y, z].iter().all(|(low, high)| low < high) => Ok(Self { ranges: [x, y, z] }),
            _ => Err(format!("'{text}' is not a box; write for example '500..1500,-800..800,200..1600' (mm, x,y,z)")),
        }
    }
}

/// `LOW..HIGH`, both finite.
fn parse_range(text: &str) -> Option<(f64, f64)> {
    let (low, high) = text.split_once("..")?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    Some((number(low)?, number(high)?))
}

fn name_and_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => Ok((name.trim().to_owned(), value.to_owned())),
        _ => Err(format!("'{text}' is not a value; write NAME=VALUE")),
    }
}

fn speed_percent(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 100.0 * MAX_SPEED => Ok(value),
        _ => Err(format!("'{text}' is not a speed between 0 and {:.0} percent", 100.0 * MAX_SPEED)),
    }
}

/// A parser of the names of a closed set, which the help and the completions list.
fn one_of<T>(names: &'static [&'static str]) -> impl TypedValueParser<Value = T>
where
    T: FromStr<Err: Into<Box<dyn Error + Send + Sync>>> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|name| name.parse::<T>())
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(format!("'{text}' is not a positive number")),
    }
}

#[cfg(test)]
mod tests;
