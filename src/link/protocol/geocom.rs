//! Leica total stations by GeoCOM in ASCII, over a serial port or TCP.
//!
//! One request is out at a time, each with a transaction number of its own; an answer with another number is thrown away. The
//! driver asks for angles and slope distance and makes the point itself, so the station and orientation that are set at the
//! instrument cannot leak in: `E = d sin V sin Hz`, `N = d sin V cos Hz`, `H = d cos V`, with V the zenith angle and Hz clockwise.

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
