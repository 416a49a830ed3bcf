//! Consecutive unreadable messages: a single one is noise, several in a row mean a wrong setting.

/// Consecutive unreadable messages that indicate a wrong setting.
const IN_A_ROW: u32 = 3;

/// Counts the unreadable messages since the last readable one.
#[derive(Clone, Copy, Debug, Default)]
pub struct ErrorStreak {
    in_a_row: u32,
}

impl ErrorStreak {
    /// Restarts the count after a readable message or a new connection.
    pub fn reset(&mut self) {
        self.in_a_row = 0;
    }

    /// Counts an unreadable message. Returns a warning when the streak is long enough, and only then. `messages` names them, such
    /// as `lines`; `why` is the reason for this one, and `check` lists the settings to check.
    pub fn record(&mut self, messages: &str, why: &str, check: &str) -> Option<String> {
        self.in_a_row = self.in_a_row.saturating_add(1);
        (self.in_a_row == IN_A_ROW)
            .then(|| format!("{IN_A_ROW} {messages} in a row cannot be read ({why}): check {check}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_third_in_a_row_is_reported() {
        let mut errors = ErrorStreak::default();
        let mut reported = |count: u32| -> Vec<String> {
            errors.reset();
            (0..count).filter_map(|_| errors.record("lines", "no number", "the baud rate")).collect()
        };
        assert_eq!(reported(2), Vec::<String>::new());
        assert_eq!(reported(1000), ["3 lines in a row cannot be read (no number): check the baud rate"]);
        assert_eq!(reported(3).len(), 1);
    }
}
