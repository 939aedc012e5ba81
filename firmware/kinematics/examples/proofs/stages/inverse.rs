//! `Wrist::inverse`: the platform's points, a leg's equation, the motors' angles.

use eel_units::Angle;

use crate::inverse::LEAST_ASSEMBLY;
use crate::trace::{Trace, Value};

/// The platform: its points over √2, and its z axis.
#[derive(Clone, Copy)]
pub struct Platform {
    pub points: [[Value; 3]; 2],
    pub normal: [Value; 3],
}

/// `Pose::platform`, from sine and cosine of yaw, pitch and roll.
pub fn platform(trace: &mut Trace, sines: [[Value; 2]; 3]) -> Platform {
    let [[sy, cy], [sp, cp], [sr, cr]] = sines;
    let sq = trace.add("sum", cr, sr);
    let sq = trace.read_as("sq", sq, 31);
    let cq = trace.subtract("difference", cr, sr);
    let cq = trace.read_as("cq", cq, 31);
    let zx = sp;
    let [sy, cy, sp, cp] = [sy, cy, sp, cp].map(|value| trace.left("", value, 1));
    let minus_sy = trace.not("minus_sy", sy);
    let minus_cy = trace.not("minus_cy", cy);
    let minus_cp = trace.not("minus_cp", cp);
    let spsq = trace.high("spsq", sp, sq);
    let spsq = trace.left("", spsq, 1);
    let spcq = trace.high("spcq", sp, cq);
    let spcq = trace.left("", spcq, 1);
    Platform {
        points: [
            [
                trace.high("x1", cp, cq),
                trace.dot("y1", &[(cy, sq), (sy, spcq)], 32),
                trace.dot("z1", &[(sy, sq), (minus_cy, spcq)], 32),
            ],
            [
                trace.high("x2", minus_cp, sq),
                trace.dot("y2", &[(cy, cq), (minus_sy, spsq)], 32),
                trace.dot("z2", &[(sy, cq), (cy, spsq)], 32),
            ],
        ],
        normal: [
            zx,
            trace.high("normal_y", minus_sy, cp),
            trace.high("normal_z", cy, cp),
        ],
    }
}

/// `Pull::assembly_room`: (W − ¾)(1 + t²) of leg 2, with t = tan(θ/2).
pub fn assembly_room(
    trace: &mut Trace,
    slope: [Value; 3],
    normal: [Value; 3],
    half_tangent: Value,
) -> Value {
    let [x, y, z] = slope;
    let pull = trace.dot(
        "assembly_pull",
        &[(x, normal[0]), (y, normal[1]), (z, normal[2])],
        32,
    );
    let pull = trace.negate("minus_assembly_pull", pull);
    let least = trace.constant("least_assembly", LEAST_ASSEMBLY.into(), 28);
    let center = trace.subtract("assembly_center", pull, least);
    let along = trace.right("assembly_along", normal[1], 2);
    let square = trace.high("tangent_square", half_tangent, half_tangent);
    let square = trace.left("", square, 2);
    let less = trace.subtract("assembly_less", center, along);
    let more = trace.add("assembly_more", center, along);
    let part = trace.high_add("assembly_part", less, more, square);
    let twice = trace.read_as("twice_tangent", half_tangent, 30);
    let turn = trace.high("assembly_turn", twice, normal[2]);
    trace.subtract("assembly_room", part, turn)
}

/// What `Pull` holds of a leg.
#[derive(Clone, Copy)]
pub struct Pull {
    pub center: [Value; 2],
    pub slope: [Value; 3],
    pub offset: Value,
}

/// Takes a leg's constants from outside.
pub fn pull(trace: &mut Trace) -> Pull {
    Pull {
        center: trace.inputs(["center_y", "center_z"], 30),
        slope: trace.inputs(["slope_x", "slope_y", "slope_z"], 30),
        offset: trace.input("offset", 30),
    }
}

/// What a leg's equation gives on the way, and at its end.
#[derive(Clone, Copy)]
pub struct Solved {
    pub e: Value,
    pub f: Value,
    pub g: Value,
    pub square: Value,
    pub root_of: Value,
    pub margin: Value,
    pub number: Value,
    pub divisor: Value,
    pub half_tangent: Value,
}

/// E, F, G and D/2 of `Pull::solve`.
pub fn terms(trace: &mut Trace, pull: &Pull, point: [Value; 3]) -> [Value; 4] {
    let e = trace.subtract("e", point[1], pull.center[0]);
    let f = trace.subtract("f", point[2], pull.center[1]);
    let [x, y, z] = pull.slope;
    let along = trace.dot("along", &[(point[0], x), (point[1], y), (point[2], z)], 30);
    let g = trace.subtract("g", pull.offset, along);
    let minus_g = trace.negate("minus_g", g);
    let square = trace.products("square", &[(e, e), (f, f), (g, minus_g)]);
    [e, f, g, square]
}

/// `Pull::solve`.
pub fn solve(trace: &mut Trace, pull: &Pull, point: [Value; 3]) -> Solved {
    let [e, f, g, square] = terms(trace, pull, point);
    let root_of = trace.right("root_of", square, 29);
    let margin = trace.root("margin", root_of);
    let number = trace.subtract("number", g, e);
    let divisor = trace.add("divisor", f, margin);
    Solved {
        e,
        f,
        g,
        square,
        root_of,
        margin,
        number,
        divisor,
        half_tangent: small_ratio(trace, number, divisor),
    }
}

/// `small_ratio`, where it answers.
pub fn small_ratio(trace: &mut Trace, number: Value, divisor: Value) -> Value {
    let half = trace.half("half", divisor, 1);
    let thirtieth = trace.half("thirtieth", divisor, 5);
    let reach = trace.add("reach", half, thirtieth);
    // number + reach wraps as i32 and is read as u32.
    let sum = trace.add("shifted_number", number, reach);
    trace.either(sum);
    let both = trace.left("both", reach, 1);
    trace.unsigned(both);
    let doubled = trace.left("doubled_number", number, 1);
    trace.ratio("half_tangent", doubled, divisor)
}

/// The motors' angles from their tangents.
pub fn angles(trace: &mut Trace, tangents: [Value; 3], zeros: [Value; 2]) -> [Value; 3] {
    let [turn1, turn2, turn3] = tangents.map(|tangent| {
        let name = format!("turn_{}", trace.node(tangent).name);
        trace.arctangent(&name, tangent)
    });
    let doubled = [
        trace.read_as("doubled1", turn1, 29),
        trace.read_as("doubled2", turn2, 29),
    ];
    let quarter = trace.constant("quarter", Angle::FRAC_PI_4.to_q29().into(), 29);
    let third = trace.right("third", turn3, 1);
    [
        trace.subtract("theta1", doubled[0], zeros[0]),
        trace.subtract("theta2", doubled[1], zeros[1]),
        trace.add("theta3", quarter, third),
    ]
}
