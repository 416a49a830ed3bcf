//! Names of the values of an enum: one list of them gives `Display`, `FromStr` and serde.
//!
//! RON writes a derived enum as a bare word. Where a file has always had a quoted text, [`crate::written_as_text`] keeps it.

use thiserror::Error;

use super::{alternatives, printable};

/// A text that names no value of an enum.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("there is no '{given}' here; it is {known}")]
pub struct UnknownName {
    given: String,
    known: String,
}

impl UnknownName {
    /// The name that was given, and the known names: the one that it resembles is proposed.
    pub fn new(given: &str, known: &[&str]) -> Self {
        let known: Vec<String> = known.iter().map(|name| format!("'{name}'")).collect();
        Self { given: printable(given), known: alternatives(&known) }
    }
}

/// Names the values of an enum, for `Display` and `FromStr`, which takes upper and lower case alike.
#[macro_export]
macro_rules! names {
    ($type:ident { $($variant:ident = $name:literal,)* }) => {
        impl $type {
            /// All values, in order.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// The names of all values, in order.
            pub const NAMES: &'static [&'static str] = &[$($name),*];

            /// The name in files and in messages.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.name())
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::text::UnknownName;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                let known = Self::ALL.iter().copied().find(|value| value.name().eq_ignore_ascii_case(text));
                known.ok_or_else(|| $crate::text::UnknownName::new(text, Self::NAMES))
            }
        }
    };
}

/// Gives an enum that is a value of an option the names of that option, for `Display` and `FromStr`.
#[macro_export]
macro_rules! names_of_option {
    ($($type:ty),*) => {$(
        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                let value = clap::ValueEnum::to_possible_value(self);
                f.write_str(value.as_ref().map_or("", clap::builder::PossibleValue::get_name))
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::text::UnknownName;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                let known = || {
                    let names: Vec<String> =
                        <Self as clap::ValueEnum>::value_variants().iter().map(ToString::to_string).collect();
                    let names: Vec<&str> = names.iter().map(String::as_str).collect();
                    $crate::text::UnknownName::new(text, &names)
                };
                <Self as clap::ValueEnum>::from_str(text, false).map_err(|_| known())
            }
        }
    )*};
}

/// Lets serde write and read a type as its text.
#[macro_export]
macro_rules! written_as_text {
    ($($type:ty),*) => {$(
        impl serde::Serialize for $type {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }

        impl<'de> serde::Deserialize<'de> for $type {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text = <std::borrow::Cow<'de, str> as serde::Deserialize>::deserialize(deserializer)?;
                text.parse().map_err(serde::de::Error::custom)
            }
        }
    )*};
}

#[cfg(test)]
#[expect(unreachable_pub, reason = "the macros make what they add public")]
mod tests {
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fruit {
        Apple,
        StoneFruit,
    }
    names!(Fruit { Apple = "apple", StoneFruit = "stone_fruit", });
    written_as_text!(Fruit);

    #[derive(Clone, Copy, Debug, PartialEq, clap::ValueEnum)]
    enum Nut {
        HazelNut,
    }
    names_of_option!(Nut);

    #[test]
    fn what_is_written_is_read_back() {
        for fruit in Fruit::ALL {
            assert_eq!(fruit.name().parse(), Ok(*fruit));
            assert_eq!(fruit.name().to_uppercase().parse(), Ok(*fruit));
            let text = ron::to_string(fruit).unwrap();
            assert_eq!(text, format!("\"{fruit}\""));
            assert_eq!(ron::from_str(&text), Ok(*fruit));
        }
        assert_eq!(Nut::HazelNut.to_string(), "hazel-nut");
        assert_eq!("hazel-nut".parse(), Ok(Nut::HazelNut));
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_known_ones() {
        let error = "pear".parse::<Fruit>().unwrap_err().to_string();
        assert_eq!(error, "there is no 'pear' here; it is 'apple' or 'stone_fruit'");
        assert!(ron::from_str::<Fruit>("\"pear\"").is_err());
        assert_eq!("x".parse::<Nut>().unwrap_err().to_string(), "there is no 'x' here; it is 'hazel-nut'");
    }
}
