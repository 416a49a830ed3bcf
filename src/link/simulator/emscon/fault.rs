//! Faults of the simulated tracker.

use super::super::fault::faults;

faults! {
    /// A fault of the simulated tracker. Its occasion is a requested measurement unless the description says otherwise.
    pub EmsconFault {
        Drip "drip" "Sends every byte in its own write. Occasion: a connection.",
        Joined "joined" "Measures instantly and sends all answers in one write. Occasion: a connection.",
        InUse "in-use" "Reports that another program is connected and closes the connection. Occasion: a connection.",
        Scaled "scaled" "Applies a transformation with scale 1.0001. Occasion: a connection.",
        Moved "moved" "Applies a transformation that shifts by 0.5 m without a scale. Occasion: a connection.",
        UnusedScale "unused-scale" "Has a transformation with scale 1.0001 but does not apply it. Occasion: a connection.",
        WarmingUp "warming-up" "The laser is warming up. Occasion: reading the system status.",
        Metres "metres" "Accepts new units but keeps metres. Occasion: setting the units.",
        TryStuck "try-stuck" "Accepts new system settings but stays in try mode. Occasion: setting them.",
        NoStationary "no-stationary" "Does not support the duration of a measurement. Occasion: setting it.",
        OwnTime "own-time" "Accepts another duration of a measurement with status 11 but keeps its own. Occasion: setting it.",
        Busy "busy" "Answers that the server is busy.",
        NotReady "not-ready" "Answers with the error 'measurement status not ready'.",
        Mute "mute" "Stops answering until the next connection.",
        Early "early" "Sends a result triggered at its own remote control before it accepts the command.",
        Flood "flood" "Sends 2000 positions of the reflector between the acceptance and the result.",
        UnitsChanged "units-changed" "Another program sets metres and degrees before the result.",
        TypeChanged "type-changed" "Another program sets spherical coordinates before the result.",
        FrameChanged "frame-changed" "Another program shifts the frame before the result.",
        ReflectorChanged "reflector-changed" "Another program selects another reflector before the result.",
        SilentMetres "silent-metres" "Sends one result in metres without notice.",
        LateError "late-error" "Accepts the command, then sends an error instead of the result.",
        UnlistedError "unlisted-error" "Accepts the command, then sends an error with an unlisted number.",
        LostBeam "lost-beam" "Accepts the command, then reports 'not ready' and sends no result.",
        Silence "silence" "Accepts the command, then sends nothing.",
        TryMode "try-mode" "Marks the result as taken in try mode.",
        WrongMode "wrong-mode" "Marks the result as the centre of a sphere.",
        BadStatus "bad-status" "Sends a result whose status is not success.",
        ZeroPoint "zero-point" "Sends a result at the origin.",
        NotFinite "not-finite" "Sends a result with a coordinate that is not a number.",
        ExtendedResult "extended-result" "Sends the result with extended statistics.",
        LongResult "long-result" "Sends a result that is 16 bytes longer than documented.",
        ShortResult "short-result" "Sends a result that is 56 bytes shorter than documented.",
        UnknownType "unknown-type" "Sends a packet of type 42 before the result.",
        CutAfter20 "cut-20" "Closes the connection after 20 bytes of the result.",
        SizeZero "size-zero" "Sends a result whose size field is 0.",
        SizeNegative "size-negative" "Sends a result whose size field is -1.",
        SizeHuge "size-huge" "Sends a result whose size field is 2 GB.",
        Closing "closing" "Reports that the server closes and closes the connection, instead of the result.",
    }
}
