//! Output variables of the interface with their types, as the manufacturer's guide lists them.

/// Type of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Bool,
    Uint32,
    Uint64,
    Int32,
    Double,
    Vector3,
    Vector6,
    Vector6Int,
}

impl Kind {
    /// Name in answers.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Bool => "BOOL",
            Self::Uint32 => "UINT32",
            Self::Uint64 => "UINT64",
            Self::Int32 => "INT32",
            Self::Double => "DOUBLE",
            Self::Vector3 => "VECTOR3D",
            Self::Vector6 => "VECTOR6D",
            Self::Vector6Int => "VECTOR6INT32",
        }
    }

    /// Encoded size (bytes).
    pub(super) const fn size(self) -> usize {
        match self {
            Self::Bool => 1,
            Self::Uint32 | Self::Int32 => 4,
            Self::Uint64 | Self::Double => 8,
            Self::Vector3 | Self::Vector6Int => 24,
            Self::Vector6 => 48,
        }
    }
}

/// Type of a variable by its name; `None` if the controller does not know it.
pub(super) fn kind(name: &str) -> Option<Kind> {
    if let Some((register, number)) = name.rsplit_once('_')
        && let Ok(number) = number.parse::<u8>()
    {
        match register {
            "output_bit_register" if (64..128).contains(&number) => return Some(Kind::Bool),
            "output_int_register" if number < 48 => return Some(Kind::Int32),
            "output_double_register" if number < 48 => return Some(Kind::Double),
            _ => {}
        }
    }
    Some(match name {
        "timestamp"
        | "actual_execution_time"
        | "speed_scaling"
        | "target_speed_fraction"
        | "actual_momentum"
        | "actual_main_voltage"
        | "actual_robot_voltage"
        | "actual_robot_current"
        | "standard_analog_input0"
        | "standard_analog_input1"
        | "standard_analog_output0"
        | "standard_analog_output1"
        | "io_current"
        | "euromap67_24V_voltage"
        | "euromap67_24V_current"
        | "tool_analog_input0"
        | "tool_analog_input1"
        | "tool_output_current"
        | "tool_temperature"
        | "tcp_force_scalar"
        | "payload" => Kind::Double,
        "target_q"
        | "target_qd"
        | "target_qdd"
        | "target_current"
        | "target_moment"
        | "actual_q"
        | "actual_qd"
        | "actual_qdd"
        | "actual_current"
        | "actual_current_window"
        | "joint_control_output"
        | "actual_TCP_pose"
        | "actual_TCP_speed"
        | "actual_TCP_force"
        | "target_TCP_pose"
        | "target_TCP_speed"
        | "joint_temperatures"
        | "actual_joint_voltage"
        | "payload_inertia"
        | "ft_raw_wrench"
        | "tcp_offset"
        | "actual_current_as_torque" => Kind::Vector6,
        "actual_tool_accelerometer" | "elbow_position" | "elbow_velocity" | "payload_cog" => Kind::Vector3,
        "joint_mode" => Kind::Vector6Int,
        "robot_mode" | "safety_mode" | "safety_status" | "tool_output_voltage" => Kind::Int32,
        "actual_digital_input_bits" | "actual_digital_output_bits" => Kind::Uint64,
        "runtime_state"
        | "robot_status_bits"
        | "safety_status_bits"
        | "analog_io_types"
        | "euromap67_input_bits"
        | "euromap67_output_bits"
        | "tool_mode"
        | "tool_analog_input_types"
        | "output_bit_registers0_to_31"
        | "output_bit_registers32_to_63"
        | "input_bit_registers0_to_31"
        | "input_bit_registers32_to_63"
        | "script_control_line" => Kind::Uint32,
        _ => return None,
    })
}
