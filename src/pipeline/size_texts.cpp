#include "pipeline/size_texts.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <sstream>

namespace hexopt {

namespace {

constexpr std::array<std::pair<const char*, RegionShape>, 6> kShapes = {{{"box", RegionShape::box},
                                                                         {"sphere", RegionShape::sphere},
                                                                         {"cylinder", RegionShape::cylinder},
                                                                         {"patch", RegionShape::patch},
                                                                         {"inside", RegionShape::inside},
                                                                         {"near", RegionShape::near}}};

std::vector<std::string> split_words(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    return words;
}

bool parse_number(std::string_view text, double& number) {
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
    return code == std::errc() && end == text.data() + text.size() && std::isfinite(number);
}

bool parse_numbers(const std::string& text, std::vector<double>& list) {
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        if (!parse_number(std::string_view(text).substr(begin, end - begin), list.emplace_back()))
            return false;
        begin = end + 1;
    }
    return true;
}

/// "size=X", "level=N" or, for regions, "size=X,Y,Z" and "within=X".
std::string parse_setting(const std::string& word, TargetSize& target, RegionTarget* region) {
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    double* distance = region ? &region->distance : nullptr;
    double value = 0;
    std::vector<double> sizes;
    if (region && name == "size" && equals != std::string::npos &&
        parse_numbers(word.substr(equals + 1), sizes) && sizes.size() == 3) {
        if (!(std::min({sizes[0], sizes[1], sizes[2]}) > 0)) return "'" + word + "': sizes must be above 0";
        region->sizes = {sizes[0], sizes[1], sizes[2]};
        return {};
    }
    if (equals == std::string::npos || !parse_number(std::string_view(word).substr(equals + 1), value))
        return "'" + word + "' is not NAME=NUMBER";
    if (name == "size" && value > 0)
        target = {value, -1};
    else if (name == "level" && value >= 0 && value <= 30 && value == std::floor(value))
        target = {0, static_cast<int>(value)};
    else if (name == "within" && distance && value >= 0)
        *distance = value;
    else
        return "'" + word + "' is not size=X, level=N" + (distance ? " or within=X" : "");
    return {};
}

std::string parse_settings(const std::vector<std::string>& words, std::size_t first, TargetSize& target,
                           RegionTarget* region) {
    for (std::size_t i = first; i < words.size(); ++i)
        if (std::string wrong = parse_setting(words[i], target, region); !wrong.empty()) return wrong;
    const bool has_sizes = region && region->sizes;
    if (has_sizes && target.is_given()) return "give one size or three";
    return has_sizes || target.is_given() ? "" : "size=X or level=N is missing";
}

bool place_shape(const std::vector<double>& x, RegionTarget& region) {
    const bool has_low = x.size() >= 3, is_sphere = region.shape == RegionShape::sphere;
    const std::size_t wanted = is_sphere ? 4 : region.shape == RegionShape::box ? 6 : 7;
    if (!has_low || x.size() != wanted) return false;
    region.low = Point(x[0], x[1], x[2]);
    if (!is_sphere) region.high = Point(x[3], x[4], x[5]);
    if (wanted != 6) region.radius = x.back();
    return true;
}

std::string setting_text(const TargetSize& target) {
    return target.level >= 0 ? fmt::format("level={}", target.level) : fmt::format("size={}", target.size);
}

} // namespace

std::string parse_region(const std::string& text, RegionTarget& region) {
    const std::vector<std::string> words = split_words(text);
    if (words.size() < 3) return "give a shape, its numbers and a size";
    bool is_known = false;
    for (const auto& [name, shape] : kShapes)
        if (words[0] == name) region.shape = shape, is_known = true;
    if (!is_known) return "the shape must be box, sphere, cylinder, patch, inside or near";
    if (region.shape == RegionShape::patch) {
        region.patch = words[1] == "*" ? std::string() : words[1];
    } else if (region.shape == RegionShape::inside || region.shape == RegionShape::near) {
        region.file = words[1];
    } else {
        std::vector<double> numbers;
        if (!parse_numbers(words[1], numbers) || !place_shape(numbers, region))
            return "a box has 6 numbers, a sphere 4 and a cylinder 7, with commas and no spaces";
    }
    return parse_settings(words, 2, region.target, &region);
}

std::string parse_curve(const std::string& text, CurveTarget& curve) {
    const std::vector<std::string> words = split_words(text);
    if (words.size() != 3) return "give two patches and a size";
    if (words[0] != "*") curve.patch = words[0];
    if (words[1] != "*") curve.other_patch = words[1];
    return parse_settings(words, 2, curve.target, nullptr);
}

std::string to_text(const RegionTarget& region) {
    const Point &a = region.low, &b = region.high;
    std::string place;
    switch (region.shape) {
    case RegionShape::box:
        place = fmt::format("box {},{},{},{},{},{}", a.x, a.y, a.z, b.x, b.y, b.z);
        break;
    case RegionShape::sphere:
        place = fmt::format("sphere {},{},{},{}", a.x, a.y, a.z, region.radius);
        break;
    case RegionShape::cylinder:
        place = fmt::format("cylinder {},{},{},{},{},{},{}", a.x, a.y, a.z, b.x, b.y, b.z, region.radius);
        break;
    case RegionShape::patch:
        place = "patch " + (region.patch.empty() ? std::string(1, '*') : region.patch);
        break;
    case RegionShape::inside:
        place = "inside " + region.file;
        break;
    case RegionShape::near:
        place = "near " + region.file;
        break;
    }
    const std::string within =
        region.distance > 0 ? fmt::format(" within={}", region.distance) : std::string();
    const std::string size =
        region.sizes ? fmt::format("size={}", fmt::join(*region.sizes, ",")) : setting_text(region.target);
    return place + " " + size + within;
}

std::string to_text(const CurveTarget& curve) {
    const auto name = [](const std::string& patch) { return patch.empty() ? std::string(1, '*') : patch; };
    return name(curve.patch) + " " + name(curve.other_patch) + " " + setting_text(curve.target);
}

} // namespace hexopt
