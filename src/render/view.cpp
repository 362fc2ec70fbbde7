#include "render/view.hpp"

#include <charconv>
#include <cmath>
#include <optional>

namespace hexopt {

namespace {

Error unusable(const std::string& what, const std::string& text, const std::string& wanted) {
    return make_error(ErrorCode::usage, "render", what + " '" + text + "'", "expected " + wanted);
}

template <class T>
std::optional<T> parse_number(const std::string& text) {
    T value{};
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || stop != end) return std::nullopt;
    return value;
}

} // namespace

View make_view(double azimuth_deg, double elevation_deg) {
    const double degree = std::acos(-1.0) / 180;
    const double ca = std::cos(azimuth_deg * degree), sa = std::sin(azimuth_deg * degree);
    const double ce = std::cos(elevation_deg * degree), se = std::sin(elevation_deg * degree);
    return {Point(-sa, ca, 0), Point(-se * ca, -se * sa, ce), Point(ce * ca, ce * sa, se)};
}

Result<View> parse_view(const std::string& text) {
    if (text == "iso") return make_view(-60, 30);
    if (text == "x") return make_view(0, 0);
    if (text == "-x") return make_view(180, 0);
    if (text == "y") return make_view(90, 0);
    if (text == "-y") return make_view(-90, 0);
    if (text == "z") return make_view(-90, 90);
    if (text == "-z") return make_view(-90, -90);
    const std::size_t comma = text.find(',');
    if (comma != std::string::npos) {
        const auto azimuth = parse_number<double>(text.substr(0, comma));
        const auto elevation = parse_number<double>(text.substr(comma + 1));
        if (azimuth && elevation && std::abs(*azimuth) <= 360 && std::abs(*elevation) <= 90)
            return make_view(*azimuth, *elevation);
    }
    return unusable("view", text, "iso, x, y, z, -x, -y, -z or azimuth,elevation in degrees, such as -60,30");
}

Result<Clip> parse_clip(const std::string& text) {
    Clip clip;
    const std::size_t start = text.starts_with('-') ? 1 : 0;
    clip.keep_above = start == 1;
    if (text.size() > start + 2 && text[start] >= 'x' && text[start] <= 'z' && text[start + 1] == '=') {
        clip.axis = text[start] - 'x';
        const auto fraction = parse_number<double>(text.substr(start + 2));
        if (fraction && *fraction >= 0 && *fraction <= 1) {
            clip.fraction = *fraction;
            return clip;
        }
    }
    return unusable("clip", text, "an axis and a fraction of the bounding box, such as x=0.5 or -z=0.25");
}

Result<PictureSize> parse_picture_size(const std::string& text) {
    const std::size_t cross = text.find('x');
    if (cross != std::string::npos) {
        const auto width = parse_number<int>(text.substr(0, cross));
        const auto height = parse_number<int>(text.substr(cross + 1));
        const auto fits = [](std::optional<int> n) { return n && *n >= 64 && *n <= 16384; };
        if (fits(width) && fits(height)) return PictureSize{*width, *height};
    }
    return unusable("size", text, "width x height in pixels, 64 to 16384 each, such as 1600x1200");
}

} // namespace hexopt
