// What shows where no geometry is: scene::environment::Environment::seen, and light::sun::SunSource::seen before it.

// Unit direction of the ray through an image point.
vec3 direction_through(vec2 point) {
    vec2 ndc = point * frame.pixel - 1.0;
    return normalize(frame.forward + frame.right * ndc.x + frame.down * ndc.y);
}

const float TURN = 6.28318530718;

// The picture in a direction, filtered over an angle.
vec3 picture_at(vec3 direction, float angle) {
    vec3 own = vec3(dot(frame.sky_axes[0], direction), dot(frame.sky_axes[1], direction), dot(frame.sky_axes[2], direction));
    float height = float(texture_extent(frame.sky).y);
    // The poles are the middles of the outer rows: beyond them the opposite rows would show.
    float level = ceil(log2(max(angle * height * 2.0 / TURN, 1.0)));
    float margin = min(0.5 / max(floor(height * exp2(-level)), 1.0), 0.5);
    float down = clamp(acos(clamp(own.y, -1.0, 1.0)) * 2.0 / TURN, margin, 1.0 - margin);
    vec2 uv = vec2(atan(own.x, own.z) / TURN + 0.5, 1.0 - down);
    vec2 width = vec2(0.0, angle * 2.0 / TURN);
    return texture_filtered(frame.sky, uv, width, width) * frame.sky_factor;
}

// Radiance at an image point, filtered over `width` pixels.
vec3 sky_at(vec2 point, float width) {
    vec3 direction = direction_through(point);
    float angle = width * max(length(direction_through(point + vec2(1.0, 0.0)) - direction),
                              length(direction_through(point + vec2(0.0, 1.0)) - direction));
    vec3 radiance = frame.sky == NONE ? vec3(0.0) : picture_at(direction, angle);
    float inside = frame.sun_reach - length(direction - frame.sun_direction);
    return radiance + frame.sun_radiance * clamp(inside / max(angle, 1e-6) + 0.5, 0.0, 1.0);
}
