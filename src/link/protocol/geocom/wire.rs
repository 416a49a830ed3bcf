//! Requests and replies as text.

use super::super::crc::crc16_arc;

/// A request to the instrument.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// Number of the remote procedure.
    pub rpc: u32,
    /// Transaction number, which the reply repeats; 0 for none.
    pub transaction: u16,
    /// Parameters, separated by commas.
    pub parameters: String,
}

/// A reply of the instrument.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    /// Result of the transport; 0 is success.
    pub transport: u32,
    /// Transaction number of the request.
    pub transaction: u16,
    /// Whether the reply had a CRC, which was right.
    pub checked: bool,
    /// Result of the procedure; 0 is success.
    pub code: u32,
    /// Parameters; valid only if both results allow it.
    pub parameters: Vec<String>,
}

/// Text of a request, without a line end.
pub fn encode_request(request: &Request, with_crc: bool) -> String {
    encode(&format!("%R1Q,{},{}", request.rpc, request.transaction), &request.parameters, with_crc)
}

/// Text of a reply, without a line end.
pub fn encode_reply(transport: u32, transaction: u16, code: u32, parameters: &str, with_crc: bool) -> String {
    let comma = if parameters.is_empty() { "" } else { "," };
    encode(&format!("%R1P,{transport},{transaction}"), &format!("{code}{comma}{parameters}"), with_crc)
}

fn encode(head: &str, body: &str, with_crc: bool) -> String {
    if with_crc {
        let crc = crc16_arc(format!("{head}:{body}").as_bytes());
        return format!("{head},{crc}:{body}");
    }
    format!("{head}:{body}")
}

/// Reads a reply. Anything before its `%R1P` is noise of a line that woke up.
pub fn decode_reply(line: &[u8]) -> Result<Reply, String> {
    let message = Message::read(line, "%R1P")?;
    let mut values = split_parameters(message.body).into_iter();
    let code = values.next().as_deref().and_then(decimal).ok_or("the return code is missing")?;
    Ok(Reply {
        transport: message.number,
        transaction: message.transaction,
        checked: message.checked,
        code,
        parameters: values.collect(),
    })
}

/// Reads a request, and whether it had a CRC.
pub fn decode_request(line: &[u8]) -> Result<(Request, bool), String> {
    let message = Message::read(line, "%R1Q")?;
    let parameters = message.body.to_owned();
    Ok((Request { rpc: message.number, transaction: message.transaction, parameters }, message.checked))
}

/// The common parts of requests and replies.
struct Message<'line> {
    number: u32,
    transaction: u16,
    checked: bool,
    body: &'line str,
}

impl<'line> Message<'line> {
    fn read(line: &'line [u8], mark: &str) -> Result<Self, String> {
        let at = line.windows(mark.len()).rposition(|window| window == mark.as_bytes());
        let message = at.and_then(|at| line.get(at..)).ok_or_else(|| format!("it contains no `{mark}`"))?;
        let text = std::str::from_utf8(message).map_err(|error| format!("it is not plain text: {error}"))?;
        let (head, body) = text.split_once(':').ok_or("it contains no `:`")?;
        let mut fields = head.split(',').skip(1);
        let number = fields.next().and_then(decimal).ok_or("its first number is missing")?;
        let transaction = match fields.next() {
            None => 0,
            Some(text) => decimal(text).and_then(|value| u16::try_from(value).ok()).ok_or("bad transaction number")?,
        };
        let checked = match fields.next() {
            None => false,
            Some(crc) => {
                let (plain, _) = head.rsplit_once(',').ok_or("no header")?;
                let right = u32::from(crc16_arc(format!("{plain}:{body}").as_bytes()));
                if decimal(crc) != Some(right) {
                    return Err(format!("its CRC is not {right}"));
                }
                true
            }
        };
        if fields.next().is_some() {
            return Err("too many fields before the `:`".to_owned());
        }
        Ok(Self { number, transaction, checked, body })
    }
}

/// Reads a number that consists of digits only.
fn decimal(text: &str) -> Option<u32> {
    (!text.is_empty() && text.len() <= 9 && text.bytes().all(|byte| byte.is_ascii_digit()))
        .then(|| text.parse().ok())?
}

/// Splits at commas outside double quotes, and removes the quotes. A backslash keeps the quote behind it.
fn split_parameters(text: &str) -> Vec<String> {
    let mut parameters = vec![String::new()];
    let mut is_quoted = false;
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        let kept = match character {
            '"' => {
                is_quoted = !is_quoted;
                None
            }
            ',' if !is_quoted => {
                parameters.push(String::new());
                None
            }
            '\\' => characters.next_if_eq(&'"').or(Some('\\')),
            other => Some(other),
        };
        if let Some(last) = parameters.last_mut() {
            last.extend(kept);
        }
    }
    parameters
}
