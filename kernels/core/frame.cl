/* Orthonormal frames (Duff et al. 2017) and directions in them: local z is the shading normal. */
typedef struct { vec3 s, t, n; } Frame;

inline Frame frame_of(vec3 n)
{
    real sign = sel(n.z >= 0.0f, (real)(1.0f), (real)(-1.0f));
    real a = -1.0f / (sign + n.z), b = n.x * n.y * a;
    Frame f;
    f.s = v3(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x);
    f.t = v3(b, sign + n.y * n.y * a, -n.y);
    f.n = n;
    return f;
}
inline vec3 to_frame(Frame f, vec3 w) { return v3(dot3(f.s, w), dot3(f.t, w), dot3(f.n, w)); }
inline vec3 to_world(Frame f, vec3 w) { return madd3(f.s, w.x, madd3(f.t, w.y, scale3(f.n, w.z))); }
inline real cos_theta(vec3 w) { return w.z; }
inline vec3 reflect_z(vec3 w) { return v3(-w.x, -w.y, w.z); } /* mirror at the local normal */
inline vec3 reflect_at(vec3 w, vec3 h) { return sub3(scale3(h, 2.0f * dot3(w, h)), w); } /* at h */
inline vec3 turned_about_z(vec3 w, real degrees, real sign) /* w in axes that are turned; sign -1: back */
{
    real s, c, turns = degrees * (1.0f / 360.0f);
    sincos_2pi(turns - floor(turns), &s, &c);
    s *= sign;
    return v3(c * w.x + s * w.y, c * w.y - s * w.x, w.z);
}
