//! Leica total stations by GeoCOM in ASCII, over a serial port or TCP.
//!
//! One request is in progress at a time, each with its own transaction number; an answer with another number is discarded. The
//! driver reads angles and slope distance and computes the point itself, so that the station and orientation set at the
//! instrument have no effect: `E = d sin V sin Hz`, `N = d sin V cos Hz`, `H = d cos V`, with V the zenith angle and Hz clockwise.

mod codes;
mod driver;
mod exchange;
mod options;
mod wire;

pub use codes::code_in_words;
pub use codes::failure_of;
pub use driver::GeocomProtocol;
pub use options::GeocomOptions;
pub use options::Measurement;
pub use wire::Reply;
pub use wire::Request;
pub use wire::decode_reply;
pub use wire::decode_request;
pub use wire::encode_reply;
pub use wire::encode_request;

#[cfg(test)]
mod tests;
