//! Shaders with one thing wrong: a patch of the source that backends compile, so the whole real path runs.
//!
//! A patch names a module, a function or constant of it, and an expression or statement that occurs there once. Comments and
//! white space of the source do not matter.

use brickfield_shaders::{PatchError, ShaderLibrary};

/// One thing wrong with the shader sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ShaderMutant {
    /// The mutant's name in reports.
    pub name: &'static str,
    module: &'static str,
    /// A function or a constant.
    declaration: &'static str,
    from: &'static str,
    to: &'static str,
}

impl ShaderMutant {
    /// The sources with this thing wrong.
    ///
    /// # Errors
    /// If the sources have changed so that the patch does not fit: then the mutant needs a new one.
    pub fn apply(&self) -> Result<ShaderLibrary, PatchError> {
        ShaderLibrary::embedded().patched_in(self.module, self.declaration, self.from, self.to)
    }
}

macro_rules! mutants {
    ($($(#[$doc:meta])* $id:ident: $name:literal, $module:literal, $declaration:literal, $from:literal => $to:literal;)*) => {
        $($(#[$doc])* pub const $id: ShaderMutant =
            ShaderMutant {
                name: concat!("shader/", $name),
                module: $module,
                declaration: $declaration,
                from: $from,
                to: $to,
            };)*
        /// All shader mutants.
        pub const ALL: &[ShaderMutant] = &[$($id),*];
    };
}

mutants! {
    /// The nearest sample instead of the trilinear value.
    NEAREST: "nearest", "texels", "filtered", "all_counted(high), cell.f)" => "all_counted(high), floor(cell.f + 0.5))";
    /// Both gathers are of one layer.
    ONE_LAYER: "one-layer", "texels", "filtered", "textureGather(0, atlas, nearest_sampler, cell.meeting, cell.layer + 1u)"
        => "textureGather(0, atlas, nearest_sampler, cell.meeting, cell.layer)";
    /// Four other texels are gathered.
    GATHERED_BESIDE: "gathered-beside", "texels", "cell_around", "(first.xy + 1.0)" => "(first.xy + 0.25)";
    /// The wrong weight along y.
    LERP_SWAPPED: "lerp-swapped", "texels", "trilinear", "return lerp(lerp(x00, x10, f.y), lerp(x01, x11, f.y), f.z);"
        => "return lerp(lerp(x00, x10, f.x), lerp(x01, x11, f.x), f.z);";
    /// Positions are not clamped to the first and last sample.
    NO_CLAMP: "no-clamp", "field/bricks", "value_at", "clamp(local(area, p), vec3f(0.0), area.last)" => "local(area, p)";
    /// Index rows are as long as columns.
    INDEX_STRIDE: "index-stride", "index", "cell_number", "cell.x + dims.x * (cell.y + dims.y * cell.z)"
        => "cell.x + dims.y * (cell.y + dims.x * cell.z)";
    /// The next slot's brick.
    ATLAS_ROW: "atlas-row", "field/bricks", "texel_of", "divided(slot, frame.atlas_bricks.x)" => "divided(slot, frame.atlas_bricks.y)";
    /// Coarse bricks are read as if they were fine.
    LEVEL_SCALE: "level-scale", "field/bricks", "patch_of", "area.scale = 1.0 / f32(1u << block.reach);" => "area.scale = 1.0;";
    /// Coarse bricks begin at the cell, not at their block.
    BLOCK_CORNER: "block-corner", "index", "block_of", "let first = (cell >> vec3u(reach)) << vec3u(reach);" => "let first = cell;";
    /// The hardware filter looks half a texel beside.
    HALF_TEXEL: "half-texel", "texels", "filtered", "(texel + s + 0.5)" => "(texel + s)";
    /// alpha = tau h.
    ALPHA_LINEAR: "alpha-linear", "scalar", "alpha", "select(1.0 - exp(-x), series, x < 0.25)" => "min(x, 1.0)";
    /// alpha = 1 - e^-x at every x: no digits near 0.
    ALPHA_CANCELS: "alpha-cancels", "scalar", "alpha", "select(1.0 - exp(-x), series, x < 0.25)" => "1.0 - exp(-x)";
    /// depth = alpha for thin segments.
    DEPTH_LINEAR: "depth-linear", "scalar", "depth", "select(direct, series, a < 0.25)" => "select(direct, a, a < 0.25)";
    /// Segments do not attenuate themselves.
    NO_SELF_ATTENUATION: "no-self-attenuation", "quadrature", "exponential", "vec4f(alpha(d) * optics.rgb, d)"
        => "vec4f(d * optics.rgb, d)";
    /// Segments are not attenuated by the segments before.
    NO_ATTENUATION: "no-attenuation", "quadrature", "behind", "ray.rgb + exp(-ray.w) * segment.rgb" => "ray.rgb + segment.rgb";
    /// The far Gauss node is not behind the near one.
    GAUSS_UNWEIGHTED: "gauss-unweighted", "quadrature", "gauss2", "near.w + far.w * exp(-0.57735027 * d)" => "near.w + far.w";
    /// A Gauss node at a quarter of the segment.
    GAUSS_NODE: "gauss-node", "quadrature", "FIRST_NODE", "0.21132486540518713" => "0.25";
    /// Euler's opacity is not depth.
    EULER_DEPTH: "euler-depth", "quadrature", "euler", "vec4f(a * optics.rgb, depth(a))" => "vec4f(a * optics.rgb, a)";
    /// The value at the start of the midpoint rule's segments.
    MIDPOINT_LEFT: "midpoint-left", "quadrature", "FIRST_NODE", "0.5" => "0.0";
    /// Pre-integrated pieces have the mean colour of their ends.
    PIECE_MEAN: "piece-mean", "preintegrated", "linear_piece", "(2.0 * near.w + far.w) / (3.0 * max(total, 1e-37))" => "0.5";
    /// The transfer function is continuous from the left.
    LEFT_CONTINUOUS: "left-continuous", "transfer", "is_from", "knot <= value" => "knot < value";
    /// The search for a knot begins two bins further.
    BIN_BEYOND: "bin-beyond", "transfer", "knot_below", "value * bins_per_value(), value > 0.0"
        => "value * bins_per_value() + 2.0, value > 0.0";
    /// The transfer function goes on beyond its last knot.
    NOT_CONSTANT_OUTSIDE: "not-constant-outside", "transfer", "at_place", "clamp((value - line.value) * line.per_value, 0.0, 1.0)"
        => "(value - line.value) * line.per_value";
    /// Steps instead of lines between knots.
    STEPS: "steps", "transfer", "at_place", "line.optics + (line.high - line.optics) * f" => "line.optics";
    /// Rays pass the pixels' corners.
    PIXEL_CORNER: "pixel-corner", "rays", "pixel_ray", "let at = pixel + 0.5 - 0.5 * vec2f(frame.size.xy);"
        => "let at = pixel - 0.5 * vec2f(frame.size.xy);";
    /// Directions are not normalised.
    NOT_NORMALISED: "not-normalised", "rays", "pixel_ray", "let length = sqrt(1.0 + square);" => "let length = 1.0;";
    /// The phase of the shells is that of a plane.
    FLAT_SHELLS: "flat-shells", "rays", "pixel_ray", "anchor_depth() * (square / (1.0 + length))" => "0.0";
    /// The first segment is not shortened.
    FIRST_NOT_CUT: "first-not-cut", "segments", "piece_of", "select(boundary(ray, k), walk.span.start, k == walk.first)"
        => "boundary(ray, k)";
    /// The last segment is not shortened.
    LAST_NOT_CUT: "last-not-cut", "segments", "piece_of", "select(boundary(ray, k + 1.0), walk.span.end, k == walk.last)"
        => "boundary(ray, k + 1.0)";
    /// The first segment is dropped.
    FIRST_DROPPED: "first-dropped", "segments", "walk_in", "walk.first = floor(" => "walk.first = ceil(";
    /// The last segment is dropped.
    LAST_DROPPED: "last-dropped", "segments", "walk_in", "walk.last = ceil(segments_before(ray, walk.span.end)) - 1.0;"
        => "walk.last = ceil(segments_before(ray, walk.span.end)) - 2.0;";
    /// A brick keeps the ray for two segments too many.
    OVERSTAYS: "overstays", "segments", "stop_in", "stop = max(k + 1.0, min(stop, min(walk.end, walk.last)));"
        => "stop = max(k + 1.0, min(stop + 2.0, min(walk.end, walk.last)));";
    /// A jump over an empty block goes 24 segments too far: two would reach only the dark rim of the next block.
    JUMPS_TOO_FAR: "jumps-too-far", "integrate/rays", "integrate", "k = patch_stop;" => "k = patch_stop + 24.0;";
    /// A leap over dark macrocells goes 8 segments too far.
    LEAPS_TOO_FAR: "leaps-too-far", "integrate/rays", "integrate", "k = end;" => "k = end + 8.0;";
    /// The same, in bricks with segments of their own.
    LEAPS_TOO_FAR_IN_BRICK: "leaps-too-far-in-brick", "integrate/bricks", "integrate_in", "walk.k = end;" => "walk.k = end + 8.0;";
    /// Dark regions reach a segment too far: of one with two nodes, the far one may lie anywhere.
    FAR_NODE_FORGOTTEN: "far-node-forgotten", "segments", "stop_near", "return stop;" => "return stop + 1.0;";
    /// Macrocells of another row are read.
    MACROCELL_ROW: "macrocell-row", "field/bricks", "dark_around", "at.x + n * (at.y + n * (at.z + n * area.slot))"
        => "at.y + n * (at.x + n * (at.z + n * area.slot))";
    /// The beam of the tile mirrored at the diagonal is read.
    BEAM_MIRRORED: "beam-mirrored", "march", "march", "beams[tile.x + tile.y * n_columns]" => "beams[tile.y + tile.x * n_columns]";
    /// Rays end where their beam has come half its way.
    BEAM_HALVED: "beam-halved", "march", "march", "walk.end = min(walk.end, beam.y);"
        => "walk.end = min(walk.end, 0.5 * (beam.x + beam.y));";
    /// The light of a ray's earlier passes is forgotten.
    PASS_FORGETS: "pass-forgets", "march", "integrate_on", "before = seen_before[slot];" => "before = vec4f(0.0);";
    /// A pass begins at the ray's first segment.
    PASS_RESTARTS: "pass-restarts", "march", "integrate_on", "walk.k = max(walk.k, first_segment());" => "";
    /// 16-bit samples are counted from the first knot's as fractions, not as integers.
    FRACTIONS_OF_16_BITS: "fractions-of-16-bits", "texels", "counted",
        "round(read * 65535.0) - counted_from()" => "(read - counted_from() / 65535.0) * 65535.0";
    /// Blocks beyond the volume's upper faces have weight.
    NO_MISSING_BLOCKS: "no-missing-blocks", "field/blocks", "weights_at",
        "select(area.cell + 1u == frame.index_dims.xyz, area.cell == vec3u(0u), upper)" => "vec3<bool>(false)";
    /// Only the lower faces of the volume have no block beyond.
    NO_UPPER_CLAMP: "no-upper-clamp", "field/blocks", "weights_at",
        "select(area.cell + 1u == frame.index_dims.xyz, area.cell == vec3u(0u), upper)"
        => "select(vec3<bool>(false), area.cell == vec3u(0u), upper)";
    /// Samples lie at the corner of their block, not in the middle of the voxels that they average.
    BLOCK_SAMPLES_AT_CORNER: "block-samples-at-corner", "field/blocks", "samples_of",
        "samples.first = corner_of(cell) + inset_of(extent, samples.stride);" => "samples.first = corner_of(cell) + 0.5;";
    /// The last sample of a short block is as far away as others.
    NO_STRETCH: "no-stretch", "field/blocks", "samples_of",
        "samples.stretch = samples.stride / (0.5 * samples.stride + 0.5 * averaged);" => "samples.stretch = vec3f(1.0);";
    /// Weights of blocks across an edge are not limited, as equation 6 has it.
    LITERAL_WEIGHTS: "literal-weights", "interblock", "block_weights",
        "let most = vec4f(max(outside.x, max(outside.y, outside.z)));" => "let most = vec4f(1.0);";
    /// Weights do not add up to 1.
    NOT_NORMALISED_WEIGHTS: "not-normalised-weights", "interblock", "block_weights",
        "let sum = dot(weights.low, vec4f(1.0)) + dot(weights.high, vec4f(1.0));" => "let sum = 1.0;";
    /// The second and third of eight blocks are taken for each other.
    BLOCKS_SWAPPED: "blocks-swapped", "field/blocks", "one_of_eight", "vec3u(b & 1u, (b >> 1u) & 1u, b >> 2u)"
        => "vec3u((b >> 1u) & 1u, b & 1u, b >> 2u)";
    /// Blocks of one sample are black.
    ONE_SAMPLE_FORGOTTEN: "one-sample-forgotten", "field/blocks", "read_among", "counted(samples.one)" => "counted(0.0)";
    /// Values are classified by their mean alone.
    SPREADS_IGNORED: "spreads-ignored", "field/blocks", "node_at", "spread_of(read.y)" => "0.0";
    /// Gradients are of the least values around a position, not of their mean.
    GRADIENT_OF_THE_LEAST: "gradient-of-the-least", "field/blocks", "value_at", "node_at(area, p).x" => "node_at(area, p).z";
    /// Blocks of one sample have no spread.
    ONE_SPREADS_FORGOTTEN: "one-spreads-forgotten", "field/blocks", "read_among",
        "unpack4x8unorm(one_spreads[cell_number(cell)]).x" => "0.0";
    /// The spread of the nearest sample.
    NEAREST_SPREAD: "nearest-spread", "texels", "filtered_spread", "trilinear(low, high, cell.f)" => "trilinear(low, high, floor(cell.f + 0.5))";
    /// Spreads of hardware filters are half a texel beside.
    SPREAD_HALF_TEXEL: "spread-half-texel", "texels", "filtered_spread", "(texel + s + 0.5)" => "(texel + s)";
    /// All blocks have the range of the first.
    RANGE_OF_FIRST_BLOCK: "range-of-first-block", "field/blocks", "read_among", "ranges[cell_number(cell)]" => "ranges[0u]";
    /// Values reach one standard deviation.
    ONE_DEVIATION: "one-deviation", "prefiltered", "SQRT_3", "1.7320508" => "1.0";
    /// A half does not make good what the range takes of the other.
    VARIANCE_LOST: "variance-lost", "prefiltered", "expected",
        "max(vec2f(wanted), wanted * (wanted / max(room.yx, vec2f(NO_ROOM))))" => "vec2f(wanted)";
    /// Values may leave the range of their blocks.
    NO_RANGE: "no-range", "prefiltered", "expected", "let reach = min(farther, room);" => "let reach = vec2f(wanted);";
    /// Both halves hold as many values.
    HALVES_ALIKE: "halves-alike", "prefiltered", "expected", "(reach.x / (reach.x + reach.y))" => "0.5";
    /// Colours are not weighted by extinction.
    COLORS_UNWEIGHTED: "colors-unweighted", "prefiltered", "emitted",
        "((2.0 * near.w + far.w) * near.rgb + (near.w + 2.0 * far.w) * far.rgb) / 6.0"
        => "0.25 * (near.w + far.w) * (near.rgb + far.rgb)";
    /// Maximum distance ends at the face.
    MAXIMUM_TO_THE_FACE: "maximum-to-the-face", "interblock", "edge_weights", "(rho + lower) / (lower + upper)"
        => "(rho + lower) / lower";
    /// Minimum distance is maximum distance.
    MINIMUM_IS_MAXIMUM: "minimum-is-maximum", "interblock", "edge_weights", "0.5 + 0.5 * rho / min(lower, upper)"
        => "(rho + lower) / (lower + upper)";
    /// The boundary is split at the wrong side.
    SPLIT_SWAPPED: "split-swapped", "interblock", "edge_weights", "select(upper, lower, rho < 0.0)"
        => "select(lower, upper, rho < 0.0)";
    /// Rays end at a transmittance of 1/5.
    ENDS_EARLY: "ends-early", "ending", "ended", "seen.w > end_depth()" => "seen.w > 1.6";
    /// Bricks have the steps of level 0, whatever their level.
    STEPS_OF_LEVEL_0: "steps-of-level-0", "segments", "in_steps_of", "own.apart *= steps_in(area);" => "";
    /// A brick's segments go on to the end of the ray.
    BRICK_NOT_LEFT: "brick-not-left", "integrate/bricks", "integrate", "span.end = min(exit, visible.end);" => "span.end = visible.end;";
    /// Nominal lengths have the angle's stretch.
    NOMINAL_STRETCHED: "nominal-stretched", "segments", "whole_piece", "piece.weight = ray.apart;" => "piece.weight = step_of(ray);";
    /// The segments of polygons begin at the surface before, even outside of the brick.
    POLYGON_NOT_CUT: "polygon-not-cut", "proxy", "piece_before", "let start = max(span.start, near);" => "let start = near;";
    /// The last segment of a brick begins a surface too early.
    LAST_SURFACE_BESIDE: "last-surface-beside", "proxy", "last_surface", "select(select(k, k - 1.0, boundary(ray, k) >= span.end), k + 1.0, boundary(ray, k + 1.0) < span.end)"
        => "k - 1.0";
    /// Polygons show the brick that is drawn before theirs.
    FOREIGN_BRICK: "foreign-brick", "proxy", "shade", "drawn[polygon.brick]" => "drawn[max(polygon.brick, 1u) - 1u]";
    /// Planes parallel to the picture are as far apart on every ray.
    PLANES_NOT_STRETCHED: "planes-not-stretched", "rays", "pixel_ray", "ray.stretch = length;"
        => "ray.stretch = 1.0;";
    /// The facet of the neighbouring square is read.
    FACET_BESIDE: "facet-beside", "rays", "facet_of", "return 2u * (square.x + square.y" => "return 2u * (square.x + 1u + square.y";
    /// Rays take the least steep stack of planes.
    STACK_FLAT: "stack-flat", "rays", "stack_of", "let axis = select(select(2u, 1u, steep.y >= steep.z), 0u, steep.x >= steep.y && steep.x >= steep.z);"
        => "let axis = select(select(2u, 1u, steep.y < steep.z), 0u, steep.x < steep.y && steep.x < steep.z);";
    /// The axes of a texture are those of space.
    PLACED_AXES: "placed-axes", "field/placed", "value_at", "vec3f(s[area.axes.x], s[area.axes.y], s[area.axes.z])" => "s";
    /// The first sample lies at the block's corner.
    PLACED_FIRST: "placed-first", "field/placed", "patch_of", "area.first = place.first + frame.first_sample.xyz;"
        => "area.first = block.corner;";
    /// The boxes of trimmed bricks end a sample early.
    KEPT_TOO_SMALL: "kept-too-small", "field/placed", "patch_of", "area.kept.high = clamp(high, area.region.low, area.region.high);"
        => "area.kept.high = clamp(high - 1.0, area.region.low, area.region.high);";
    /// Beside a trimmed brick's box it is dark to the box's far face.
    DARK_PAST_THE_BOX: "dark-past-the-box", "field/placed", "dark_around", "around.region.high[axis] = area.kept.low[axis];"
        => "around.region.high[axis] = area.kept.high[axis];";
    /// Slots are read as if they were of level 0.
    PLACED_SCALE: "placed-scale", "field/placed", "patch_of", "area.scale = 1.0 / f32(1u << place.level);" => "area.scale = 1.0;";
    /// Gradients are of the grid's axes, not of the world's.
    NORMAL_OF_THE_GRID: "normal-of-the-grid", "light", "shade_at",
        "light.steepness_x.xyz * slope.x + light.steepness_y.xyz * slope.y + light.steepness_z.xyz * slope.z"
        => "slope * length(light.steepness_x.xyz)";
    /// Light comes from the other side.
    LIGHT_FROM_BEHIND: "light-from-behind", "light", "towards_light", "light.source.xyz - light.source.w * in_world(p)"
        => "light.source.w * in_world(p) - light.source.xyz";
    /// The way to a near light is counted in voxels.
    LIGHT_IN_VOXELS: "light-in-voxels", "light", "towards_light", "in_world(p)" => "p";
    /// Every medium is a surface.
    SURFACES_EVERYWHERE: "surfaces-everywhere", "light", "shade_at", "sqrt(square / (1.0 + square))" => "1.0";
    /// Highlights where there is hardly a surface.
    HIGHLIGHT_WITHOUT_STRENGTH: "highlight-without-strength", "light", "shade_of", "strength * light.specular" => "light.specular";
    /// Highlights face the eye.
    NOT_HALFWAY: "not-halfway", "light", "shade_at", "dot(normal, halfway)" => "dot(normal, to_eye)";
    /// The side of higher values is never lit.
    BACK_IN_THE_DARK: "back-in-the-dark", "light", "facing", "light.back.x * cosine" => "0.0";
    /// Pre-integrated segments have the shade of their near end.
    NEAR_SHADE_ALONE: "near-shade-alone", "light", "between", "0.5 * (near.factor + far.factor)" => "near.factor";
    /// Gradients do not ask the next brick.
    GRADIENT_OF_ONE_PATCH: "gradient-of-one-patch", "gradient/central", "beside", "all(p >= area.region.low) && all(p < area.region.high)"
        => "true";
    /// Slopes are over two steps, even where the volume ends.
    SLOPE_OVER_TWO_STEPS: "slope-over-two-steps", "gradient/central", "slope", "dot(behind.at - before.at, vec3f(1.0))"
        => "2.0 * dot(way, vec3f(1.0))";
    /// Gradients of coarse bricks are taken from neighbouring voxels.
    SPACING_OF_LEVEL_0: "spacing-of-level-0", "field/bricks", "spacing_at", "return 1.0 / area.scale;" => "return 1.0;";
    /// Gradients between blocks are taken over the spacing of one of them.
    SPACING_OF_OWN_BLOCK: "spacing-of-own-block", "field/blocks", "spacing_at",
        "dot(weights.low, strides.low) + dot(weights.high, strides.high)" => "area.samples.stride";
    /// The root of a stored gradient's length is its length.
    STORED_LENGTH_NOT_SQUARED: "stored-length-not-squared", "gradient/stored", "gradient_at", "codes.w * codes.w" => "codes.w";
    /// Stored directions have no negative components.
    STORED_DIRECTION_UNSIGNED: "stored-direction-unsigned", "gradient/stored", "gradient_at", "(codes.xyz * 255.0 - ZERO) / ZERO"
        => "codes.xyz";
    /// Blocks of one sample have no gradient.
    ONE_GRADIENT_FORGOTTEN: "one-gradient-forgotten", "field/blocks", "codes_among",
        "unpack4x8unorm(one_gradients[cell_number(cell)])" => "vec4f(0.0)";
    /// Stored gradients are of the nearest block alone.
    STORED_ACROSS_BLOCKS: "stored-across-blocks", "field/blocks", "codes_at",
        "sum += weight * codes_among(samples_of(cell, blocks[cell_number(cell)]), cell, p);"
        => "sum += weight * codes_among(area.samples, area.cell, p);";
    /// Packed coefficients have no sign.
    UNPACKED_UNSIGNED: "unpacked-unsigned", "decode", "unzigzag", "i32(n >> 1u) ^ -i32(n & 1u)" => "i32(n >> 1u)";
    /// Halves of details are rounded toward 0.
    UNDONE_TOWARD_ZERO: "undone-toward-zero", "decode", "undo_line", "own - (detail >> 1u)" => "own - detail / 2";
    /// Lines along x begin where lines along z do.
    UNDONE_AXES: "undone-axes", "decode", "across_axis", "decoding.axis == 0u" => "decoding.axis == 2u";
    /// Lossy values are not multiplied by their step.
    UNPACKED_STEP: "unpacked-step", "decode", "sample", "value * brick.step" => "value";
    /// Predictions are left out.
    UNPREDICTED: "unpredicted", "decode", "undo_line", "is_predicted && n_low > 1u" => "false";
    /// Corners have each other's weights.
    MESH_WEIGHTS_SWAPPED: "mesh-weights-swapped", "mesh", "mixed", "a * seen.weight.x + b * seen.weight.y" => "b * seen.weight.x + a * seen.weight.y";
    /// Colours are constant between knots.
    MESH_COLOR_BELOW: "mesh-color-below", "mesh", "color_of", "colors[min(below + 1u, mesh_view.n_knots - 1u)]" => "colors[below]";
    /// A colour map is continuous from the left at a jump.
    MESH_COLOR_LEFT: "mesh-color-left", "mesh", "color_of", "colors[middle].w <= value" => "colors[middle].w < value";
    /// The depth instead of the distance.
    MESH_DEPTH: "mesh-depth", "mesh", "paint", "depth * length(ray.direction)" => "depth";
    /// Lengths are in world units.
    MESH_UNIT: "mesh-unit", "mesh", "paint", "length(ray.direction) * mesh_view.unit" => "length(ray.direction)";
    /// The normal of the first corner.
    MESH_NORMAL_OF_CORNER: "mesh-normal-of-corner", "mesh", "normal_of", "mixed(seen, seen.a.normal, seen.b.normal, seen.c.normal).xyz"
        => "seen.a.normal.xyz";
    /// Normals do not turn to the eye.
    MESH_NORMAL_AWAY: "mesh-normal-away", "mesh", "normal_of", "select(unit, -unit, dot(unit, ray.direction) > 0.0)" => "unit";
    /// Highlights are where the surface faces the light.
    MESH_HIGHLIGHT: "mesh-highlight", "mesh", "lit", "unit_or_nothing(to_light + to_eye)" => "to_light";
    /// A place of light is a direction.
    MESH_PLACE: "mesh-place", "mesh", "lit", "max(mesh_view.source.w, 0.0) * point" => "0.0 * point";
    /// Lines along the second edge are looked for along the third.
    MESH_LINE_EDGE: "mesh-line-edge", "mesh", "line_at", "select(1e9, pixels_from(ray, b, c), (edges & 2u) != 0u)"
        => "select(1e9, pixels_from(ray, c, a), (edges & 2u) != 0u)";
    /// The anchors of neighbouring pixels are taken for one.
    MESH_LINE_SLOPE: "mesh-line-slope", "mesh", "pixels_from", "+ triple(ray, mesh_view.anchor_right.xyz, along)" => "";
    /// The value of a cell's first corner.
    CELLS_NEAREST: "cells-nearest", "cells", "value_at", "return here.w + dot(vec3f(du.w, dv.w, dw.w), change);" => "return corner[0].w;";
    /// The guess of the place in a cell is its place.
    CELLS_GUESS: "cells-guess", "cells", "value_at", "local += change;" => "local += change * 0.0;";
    /// Rows of cells end with their last whole segment.
    CELLS_LAST_DROPPED: "cells-last-dropped", "cells", "row_of_cells", "if begun < to" => "if false";
    /// The next cell is entered through the other half of the face.
    CELLS_WRONG_FACE: "cells-wrong-face", "cells", "leave", "exit.triangle ^ 2u" => "exit.triangle ^ 3u";
    /// Left-handed cells are taken for right-handed ones.
    CELLS_HANDEDNESS: "cells-handedness", "cells", "handedness", "frame.voxel_world.y" => "1.0";
    /// Two cells do not agree on which side a line through their edge passes it.
    CELLS_TIES: "cells-ties", "cells", "side", "select(turn, sign(p.y - q.y), turn == 0)" => "select(turn, 2 * i32(a & 1u) - 1, turn == 0)";
    /// Cells that are left out are walked through.
    CELLS_VOIDS: "cells-voids", "cells", "is_void", "((voids[number >> 5u] >> (number & 31u)) & 1u) == 1u" => "voids[0] == 12345u";
    /// Rays do not end at surfaces.
    CELLS_SURFACE: "cells-surface", "cells", "march_cells", "end = surface.w - ray.phase;" => "end = FAR;";
    /// Cells behind the eye are seen.
    CELLS_EYE: "cells-eye", "cells", "through_cells", "var reached = ray.eye;" => "var reached = -FAR;";
    /// Opacity is the depth.
    OPACITY_IS_DEPTH: "opacity-is-depth", "march", "march", "vec4f(seen.rgb, alpha(seen.w))" => "vec4f(seen.rgb, min(seen.w, 1.0))";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_patch_fits_the_sources() {
        for mutant in ALL {
            assert_ne!(mutant.apply().unwrap(), ShaderLibrary::embedded(), "{}", mutant.name);
        }
    }
}
