//! Responses of HTTP/1.1 and the answer to a digest challenge (RFC 2617), as far as reading a value from a controller needs them.

use super::md5::md5_hex;

/// Largest response (bytes).
pub const MAX_RESPONSE: usize = 65_536;

/// A response.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Response {
    /// Status code.
    pub status: u16,
    /// Names in lower case with their values.
    headers: Vec<(String, String)>,
    /// Content.
    pub body: Vec<u8>,
}

impl Response {
    /// Values of a header with this name in lower case.
    pub fn headers(&self, name: &str) -> impl Iterator<Item = &str> {
        self.headers.iter().filter(move |(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// Whether the server closes the connection after this response.
    pub fn closes(&self) -> bool {
        self.headers("connection").any(|value| value.eq_ignore_ascii_case("close"))
    }

    /// Reads the response at the beginning of the received bytes, with its length. `None`: it is not complete.
    ///
    /// # Errors
    /// It is not a response that can be read; returns the reason.
    pub fn read(bytes: &[u8]) -> Result<Option<(Self, usize)>, String> {
        let magic = b"HTTP/1.";
        let start = bytes.get(..magic.len().min(bytes.len())).unwrap_or_default();
        if !magic.starts_with(start) {
            return Err("it is not a response of HTTP".to_owned());
        }
        let Some(end) = bytes.windows(4).position(|window| window == b"\r\n\r\n") else {
            return if bytes.len() > MAX_RESPONSE { Err("its head is too long".to_owned()) } else { Ok(None) };
        };
        let (head, rest) = bytes.split_at_checked(end + 4).unwrap_or((bytes, &[]));
        let head = String::from_utf8_lossy(head);
        let mut lines = head.lines();
        let status =
            lines.next().and_then(|line| line.split(' ').nth(1)?.parse().ok()).ok_or("its status is missing")?;
        let pair = |line: &str| {
            line.split_once(':').map(|(name, value)| (name.trim().to_lowercase(), value.trim().to_owned()))
        };
        let response = Self { status, headers: lines.filter_map(pair).collect(), body: Vec::new() };
        let is_chunked = response.headers("transfer-encoding").any(|value| value.eq_ignore_ascii_case("chunked"));
        let body = if is_chunked { chunked(rest)? } else { response.sized(rest)? };
        Ok(body.map(|(body, length)| (Self { body, ..response }, end + 4 + length)))
    }

    /// A content whose length the head states, with that length.
    fn sized(&self, rest: &[u8]) -> Result<Option<(Vec<u8>, usize)>, String> {
        let stated = self.headers("content-length").next();
        let length = stated.map_or(Some(0), |text| text.parse().ok()).ok_or("its length cannot be read")?;
        if length > MAX_RESPONSE {
            return Err(format!("its content has {length} bytes"));
        }
        Ok(rest.get(..length).map(|body| (body.to_vec(), length)))
    }
}

/// A content in chunks, with the length of all of them.
fn chunked(bytes: &[u8]) -> Result<Option<(Vec<u8>, usize)>, String> {
    let mut body = Vec::new();
    let mut at = 0;
    loop {
        let rest = bytes.get(at..).unwrap_or_default();
        let Some(end) = rest.windows(2).position(|window| window == b"\r\n") else {
            return if rest.len() > 64 { Err("the length of a chunk is missing".to_owned()) } else { Ok(None) };
        };
        let line = String::from_utf8_lossy(rest.get(..end).unwrap_or_default());
        let size = line.split(';').next().map(str::trim).and_then(|size| usize::from_str_radix(size, 16).ok());
        let size =
            size.filter(|size| body.len() + size <= MAX_RESPONSE).ok_or("the length of a chunk cannot be read")?;
        let Some(chunk) = rest.get(end + 2..end + 2 + size + 2) else { return Ok(None) };
        at += end + 2 + size + 2;
        if size == 0 {
            return Ok(Some((body, at)));
        }
        body.extend(chunk.get(..size).unwrap_or_default());
    }
}

/// A digest challenge with the number of answers so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Challenge {
    realm: String,
    nonce: String,
    opaque: Option<String>,
    has_quality: bool,
    count: u32,
}

impl Challenge {
    /// Reads the value of `WWW-Authenticate`; `None` if it is not a digest challenge that can be answered.
    pub fn read(value: &str) -> Option<Self> {
        let (scheme, rest) = value.split_once(' ')?;
        if !scheme.eq_ignore_ascii_case("digest") {
            return None;
        }
        let of = |name: &str| {
            fields(rest).into_iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, value)| value)
        };
        if of("algorithm").is_some_and(|algorithm| !algorithm.eq_ignore_ascii_case("md5")) {
            return None;
        }
        let qualities = of("qop");
        let has_quality = qualities.as_deref().is_some_and(|all| all.split(',').any(|one| one.trim() == "auth"));
        if qualities.is_some() && !has_quality {
            return None;
        }
        Some(Self { realm: of("realm")?, nonce: of("nonce")?, opaque: of("opaque"), has_quality, count: 0 })
    }

    /// The challenge after this many answers.
    #[must_use]
    pub const fn after(mut self, count: u32) -> Self {
        self.count = count;
        self
    }

    /// Value of `Authorization` for the next request.
    pub fn answer(&mut self, user: &str, password: &str, method: &str, uri: &str, client_nonce: &str) -> String {
        self.count = self.count.wrapping_add(1);
        let Self { realm, nonce, opaque, has_quality, count } = self;
        let secret = md5_hex(&format!("{user}:{realm}:{password}"));
        let request = md5_hex(&format!("{method}:{uri}"));
        let (middle, quality) = if *has_quality {
            let count = format!("{count:08x}");
            (
                format!("{nonce}:{count}:{client_nonce}:auth"),
                format!(", qop=auth, nc={count}, cnonce=\"{client_nonce}\""),
            )
        } else {
            (nonce.clone(), String::new())
        };
        let response = md5_hex(&format!("{secret}:{middle}:{request}"));
        let opaque = opaque.as_ref().map_or_else(String::new, |opaque| format!(", opaque=\"{opaque}\""));
        format!(
            "Digest username=\"{user}\", realm=\"{realm}\", nonce=\"{nonce}\", uri=\"{uri}\"{quality}, response=\"{response}\"{opaque}"
        )
    }
}

/// Fields `name=value` or `name="value"`, separated by commas.
fn fields(text: &str) -> Vec<(String, String)> {
    let mut fields = Vec::new();
    let mut rest = text;
    while let Some((name, after)) = rest.split_once('=') {
        let name = name.trim_matches([',', ' ']).to_owned();
        let (value, after) = match after.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').unwrap_or((quoted, "")),
            None => after.split_once(',').unwrap_or((after, "")),
        };
        fields.push((name, value.trim().to_owned()));
        rest = after;
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_answer_of_the_standard_comes_out() {
        let challenge = "Digest realm=\"testrealm@host.com\", qop=\"auth,auth-int\", \
                         nonce=\"dcd98b7102dd2f0e8b11d0f600bfb0c093\", opaque=\"5ccc069c403ebaf9f0171e9517f40e41\"";
        let mut challenge = Challenge::read(challenge).unwrap();
        let answer = challenge.answer("Mufasa", "Circle Of Life", "GET", "/dir/index.html", "0a4f113b");
        assert!(answer.contains("response=\"6629fae49393a05397450978507c4ef1\""), "{answer}");
        assert!(answer.contains("nc=00000001") && answer.contains("opaque=\"5ccc069c403ebaf9f0171e9517f40e41\""));
        assert!(challenge.answer("Mufasa", "Circle Of Life", "GET", "/", "0a4f113b").contains("nc=00000002"));
        assert_eq!(Challenge::read("Basic realm=\"x\""), None);
        assert_eq!(Challenge::read("Digest realm=\"x\", nonce=\"y\", algorithm=SHA-256"), None);
    }

    #[test]
    fn responses_are_read_with_a_length_and_in_chunks() {
        let sized = b"HTTP/1.1 200 OK\r\nContent-Length: 3\r\nSet-Cookie: a=b; path=/\r\n\r\nabcHTTP";
        let (response, length) = Response::read(sized).unwrap().unwrap();
        assert_eq!((response.status, response.body.as_slice(), length), (200, &b"abc"[..], sized.len() - 4));
        assert_eq!(response.headers("set-cookie").collect::<Vec<_>>(), ["a=b; path=/"]);
        for end in 0..length {
            assert_eq!(Response::read(&sized[..end]), Ok(None), "{end}");
        }
        let chunks = b"HTTP/1.1 401 No\r\nTransfer-Encoding: chunked\r\n\r\n2\r\nab\r\n1;x\r\nc\r\n0\r\n\r\n";
        let (response, length) = Response::read(chunks).unwrap().unwrap();
        assert_eq!((response.status, response.body.as_slice(), length), (401, &b"abc"[..], chunks.len()));
        for end in 0..chunks.len() {
            assert_eq!(Response::read(&chunks[..end]), Ok(None), "{end}");
        }
        for bad in [
            &b"SSH-2.0"[..],
            b"HTTP/1.1\r\n\r\n",
            b"HTTP/1.1 200 OK\r\nContent-Length: -1\r\n\r\n",
            b"HTTP/1.1 200 OK\r\nContent-Length: 99999999\r\n\r\n",
            b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nxyz\r\n",
        ] {
            assert!(Response::read(bad).is_err(), "{}", String::from_utf8_lossy(bad));
        }
    }
}
