// Luminance where no drawn triangle covers a pixel of a visible face (T-junctions on creases, slivers): neighbours stand in. Only
// pixels without depth are drawn with this, since it would double the cost of all others.

// Adds the drawn pixels within `reach` of p, those of face `id` only or (0) those of any; returns their number.
float add_around(ivec2 p, int reach, uint id, inout Luminance sum) {
    ivec2 low = max(p - reach, ivec2(0));
    ivec2 high = min(p + reach, textureSize(ids, 0) - 1);
    float drawn = 0.0;
    for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
            vec4 diffuse = texelFetch(image_diffuse, ivec2(x, y), 0);
            if (diffuse.a > 0.0 && (id == 0u || texelFetch(ids, ivec2(x, y), 0).x == id)) {
                sum.diffuse += diffuse.rgb;
                sum.specular += texelFetch(image_specular, ivec2(x, y), 0).rgb;
                drawn += 1.0;
            }
        }
    }
    return drawn;
}

// The nearest neighbours of the pixel's own face, else of any face, else nothing.
Luminance luminance_around(ivec2 p) {
    Luminance sum = luminance_at(p);
    uint id = texelFetch(ids, p, 0).x;
    if (id == 0u || texelFetch(image_diffuse, p, 0).a > 0.0) {
        return sum; // background, or drawn without depth
    }
    float drawn = 0.0;
    for (int attempt = 0; attempt < 4 && drawn == 0.0; ++attempt) {
        drawn = add_around(p, 1 + attempt % 2, attempt < 2 ? id : 0u, sum);
    }
    float share = 1.0 / max(drawn, 1.0);
    return Luminance(sum.diffuse * share, sum.specular * share);
}
