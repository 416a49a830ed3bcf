//! Step Profile: which robot.

use super::{Action, Cx, StepMachine};
use crate::profile::datasheet::Datasheet;
use crate::profile::{Profile, builtin_names};
use crate::session::journal::Entry;
use crate::session::set_up::Step;
use crate::session::sha256;
use crate::text::printable;
use crate::wizard::effect::{Answer, Request};
use crate::wizard::intent::{Intent, IntentInfo};
use crate::wizard::notice::Notice;
use crate::wizard::view::{Content, ProfileCard, ProfileView, SessionCard, SessionChoice};

/// The profile step with a profile that is loaded but not yet confirmed.
#[derive(Clone, Debug, Default)]
pub(in crate::wizard) struct ProfileStep {
    chosen: Option<Box<LoadedProfile>>,
    name: Option<String>,
    /// The last data sheet, to be corrected.
    sheet: Datasheet,
}

#[derive(Clone, Debug)]
struct LoadedProfile {
    source: String,
    text: String,
    profile: Profile,
    warnings: Vec<String>,
}

impl ProfileStep {
    /// Sessions on offer, as long as this one has no robot.
    fn sessions(&self, cx: &Cx<'_>) -> Vec<SessionChoice> {
        if self.chosen.is_some() || cx.robot().is_some() {
            return Vec::new();
        }
        let choice = |card: &SessionCard| SessionChoice {
            name: card.name.clone(),
            folder: card.folder.clone(),
            robot: card.robot.clone().unwrap_or_else(|| "no robot yet".to_owned()),
            progress: card.progress(cx.now),
        };
        cx.sessions.iter().map(choice).collect()
    }

    /// Name of the session: the operator's, or robot and date.
    fn session_name(&self, cx: &Cx<'_>) -> Option<String> {
        let chosen = self.chosen.as_ref()?;
        Some(self.name.clone().unwrap_or_else(|| {
            // `2026-03-01T09:15:02Z` becomes `20260301-0915`.
            let digits: String = cx.now.to_string().chars().filter(char::is_ascii_digit).take(12).collect();
            let (date, time) = digits.split_at_checked(8).unwrap_or((&digits, ""));
            format!("{}-{date}-{time}", chosen.profile.name())
        }))
    }
}

impl StepMachine for ProfileStep {
    fn intents(&self, cx: &Cx<'_>) -> Vec<IntentInfo> {
        let fixed = cx.session.has_measurements().then(|| {
            "points have already been measured: a session has only one robot; start another session".to_owned()
        });
        let none = (self.chosen.is_none() && cx.robot().is_none()).then(|| "choose a robot first".to_owned());
        let named = cx.session.opened.is_some().then(|| "the session already has a name".to_owned());
        let first = builtin_names().next().unwrap_or_default().to_owned();
        let proposal = self.session_name(cx).unwrap_or_default();
        let sessions = self.sessions(cx).into_iter().map(|session| {
            let label = format!("continue {}, {}", session.name, session.progress);
            IntentInfo::new(Intent::ResumeSession(session.folder), label)
        });
        let mut intents = vec![
            IntentInfo::new(Intent::Next, "use this robot").unless(none).default_action(),
            IntentInfo::new(Intent::ChooseProfile(first), "choose a robot").unless(fixed.clone()),
            IntentInfo::new(Intent::DescribeRobot(Box::new(self.sheet.clone())), "robot from a data sheet")
                .unless(fixed),
            IntentInfo::new(Intent::NameSession(proposal), "name the session").unless(named),
        ];
        intents.extend(sessions);
        intents
    }

    fn on_intent(&mut self, intent: Intent, cx: &Cx<'_>) -> Vec<Action> {
        match intent {
            Intent::ChooseProfile(source) => vec![Action::Ask(Request::LoadProfile { source })],
            Intent::DescribeRobot(sheet) => {
                self.sheet = *sheet;
                match self.sheet.profile() {
                    Ok((text, profile)) => {
                        let warnings = profile.gaps().into_iter().map(|gap| gap.message).collect();
                        let source = "data sheet".to_owned();
                        self.chosen = Some(Box::new(LoadedProfile { source, text, profile, warnings }));
                        Vec::new()
                    }
                    Err(error) => vec![Action::Say(Notice::error(format!("no robot from this data sheet: {error}")))],
                }
            }
            Intent::NameSession(name) => {
                let usable = !name.is_empty()
                    && name.len() <= 64
                    && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'))
                    && !name.starts_with(['.', '-']);
                if usable {
                    self.name = Some(name);
                    return Vec::new();
                }
                let name = printable(&name);
                vec![Action::Say(
                    Notice::error(format!("'{name}' is not a valid session name"))
                        .hint("use up to 64 letters, digits, '-', '_' and '.', starting with a letter or digit"),
                )]
            }
            Intent::Next => {
                let Some(chosen) = &self.chosen else { return vec![Action::go(Step::Instrument)] };
                let sha256 = sha256(chosen.text.as_bytes());
                let profile = Entry::Profile { source: chosen.source.clone(), sha256, text: chosen.text.clone() };
                let entries = vec![profile, Entry::Step(Step::Instrument)];
                if let (None, Some(name)) = (cx.session.opened, self.session_name(cx)) {
                    return vec![Action::Create { name, entries }];
                }
                // A connected instrument was set up for the previous robot.
                let profile = Box::new(chosen.profile.clone());
                let instrument = cx.session.instrument.clone();
                let connect = instrument.map(|instrument| Action::Ask(Request::Connect { instrument, profile }));
                [Action::Write(entries), Action::Disconnect].into_iter().chain(connect).collect()
            }
            _ => Vec::new(),
        }
    }

    fn on_answer(&mut self, answer: Answer, _cx: &Cx<'_>) -> Vec<Action> {
        let Answer::Profile { source, text } = answer else { return Vec::new() };
        match Profile::parse(&text, &source) {
            Ok((profile, warnings)) => {
                let gaps = profile.gaps().into_iter().map(|gap| gap.message);
                let warnings = warnings.iter().map(ToString::to_string).chain(gaps).collect();
                self.chosen = Some(Box::new(LoadedProfile { source, text, profile, warnings }));
                Vec::new()
            }
            Err(errors) => {
                let what = format!("profile '{source}' cannot be used\n{errors}");
                vec![Action::Say(Notice::error(what).hint("fix the file, then select it again"))]
            }
        }
    }

    fn content(&self, cx: &Cx<'_>) -> Content {
        let shown = self.chosen.as_ref().map(|chosen| (&chosen.profile, chosen.warnings.clone()));
        let shown = shown.or_else(|| cx.robot().map(|robot| (&robot.profile, Vec::new())));
        Content::Profile(ProfileView {
            profiles: builtin_names().map(str::to_owned).collect(),
            chosen: shown.map(|(profile, warnings)| ProfileCard::new(profile, warnings)),
            session: match cx.session.opened {
                Some(_) => cx.session.name.clone(),
                None => self.session_name(cx).unwrap_or_default(),
            },
            is_fixed: cx.session.has_measurements(),
            sessions: self.sessions(cx),
        })
    }
}
