#include "io/scalar.hpp"
#include "io/surface_readers.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <optional>

namespace hexopt::io_detail {

namespace {

constexpr std::pair<std::string_view, Scalar> kScalars[] = {
    {"char", Scalar::int8},      {"uchar", Scalar::uint8},    {"short", Scalar::int16},
    {"ushort", Scalar::uint16},  {"int", Scalar::int32},      {"uint", Scalar::uint32},
    {"float", Scalar::float32},  {"double", Scalar::float64}, {"int8", Scalar::int8},
    {"uint8", Scalar::uint8},    {"int16", Scalar::int16},    {"uint16", Scalar::uint16},
    {"int32", Scalar::int32},    {"uint32", Scalar::uint32},  {"float32", Scalar::float32},
    {"float64", Scalar::float64}};

struct Property {
    std::string name;
    Scalar scalar = Scalar::float32;
    std::optional<Scalar> length; ///< of a list
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

class PlyReader {
  public:
    PlyReader(Scanner& scanner, SurfaceBuilder& builder) : scanner_(scanner), builder_(builder) {}
    bool read();

  private:
    bool read_header();
    bool read_header_line(std::string_view line);
    bool read_property(Scanner& words);
    bool read_element(const Element& element);
    bool read_item(const Element& element);
    bool read_value(Scalar scalar, double& value);
    bool read_list(const Property& property, bool is_kept);
    std::size_t least_bytes(const Element& element) const;
    bool fail(std::string reason) {
        return scanner_.fail(std::move(reason), "the file is damaged or cut short; write or copy it again");
    }

    Scanner& scanner_;
    SurfaceBuilder& builder_;
    bool is_text_ = false, has_format_ = false;
    std::endian order_ = std::endian::little;
    std::vector<Element> elements_;
    std::vector<Index> ids_;
};

bool PlyReader::read_property(Scanner& words) {
    if (elements_.empty()) return fail("a property before any element");
    const auto scalar_of = [&](std::string_view word) -> std::optional<Scalar> {
        for (const auto& [name, scalar] : kScalars)
            if (name == word) return scalar;
        return std::nullopt;
    };
    Property property;
    std::string_view type = words.token();
    if (type == "list") {
        property.length = scalar_of(words.token());
        if (!property.length || !is_integer(*property.length))
            return fail("a list whose length has no integer type");
        type = words.token();
    }
    const std::optional<Scalar> scalar = scalar_of(type);
    if (!scalar) return fail(fmt::format("property type '{}' is not known", shown(type)));
    property.scalar = *scalar;
    property.name = std::string(words.token());
    elements_.back().properties.push_back(std::move(property));
    return true;
}

bool PlyReader::read_header_line(std::string_view line) {
    Scanner words("", line);
    const std::string_view word = words.token();
    if (word == "format") {
        const std::string_view format = words.token();
        is_text_ = format == "ascii";
        order_ = format == "binary_big_endian" ? std::endian::big : std::endian::little;
        if (!is_text_ && !format.starts_with("binary_"))
            return fail(fmt::format("format '{}' is not known", shown(format)));
        has_format_ = true;
        return true;
    }
    if (word == "element") {
        Element element;
        std::int64_t count = 0;
        element.name = std::string(words.token());
        if (!words.read_int(count) || count < 0) return fail("an element without a count");
        element.count = static_cast<std::size_t>(count);
        elements_.push_back(std::move(element));
        return true;
    }
    if (word == "property") return read_property(words);
    if (word.empty() || word == "comment" || word == "obj_info") return true;
    return fail(fmt::format("'{}' stands in the header", shown(word)));
}

bool PlyReader::read_header() {
    scanner_.line(); // "ply"
    for (;;) {
        if (scanner_.remaining() == 0) return fail("the header does not end");
        const std::string_view line = scanner_.line();
        if (line.starts_with("end_header")) break;
        if (!read_header_line(line)) return false;
    }
    if (!has_format_) return fail("the header names no format");
    if (!is_text_) scanner_.set_binary();
    return true;
}

std::size_t PlyReader::least_bytes(const Element& element) const {
    std::size_t bytes = 0;
    for (const Property& property : element.properties)
        bytes += is_text_ ? 2 : size_of(property.length.value_or(property.scalar));
    return bytes;
}

bool PlyReader::read_value(Scalar scalar, double& value) {
    if (is_text_) return scanner_.read_double(value);
    const std::string_view raw = scanner_.raw(size_of(scalar));
    for_each_scalar(scalar, raw, order_,
                    [&](std::size_t, auto number) { value = static_cast<double>(number); });
    return scanner_.ok();
}

bool PlyReader::read_list(const Property& property, bool is_kept) {
    double length = 0;
    if (!read_value(*property.length, length)) return false;
    if (!(length >= 0) || length != std::floor(length) ||
        length > static_cast<double>(scanner_.remaining() / (is_text_ ? 1 : size_of(property.scalar))))
        return fail(fmt::format("a list of {} entries", length));
    if (is_kept) ids_.clear();
    for (std::size_t i = 0; i < static_cast<std::size_t>(length); ++i) {
        double value = 0;
        if (!read_value(property.scalar, value)) return false;
        if (!is_kept) continue;
        if (!(value >= 0 && value < kNoIndex) || value != std::floor(value))
            return fail(fmt::format("vertex id {}", value));
        ids_.push_back(static_cast<Index>(value));
    }
    return true;
}

bool PlyReader::read_item(const Element& element) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    Point p(0);
    for (const Property& property : element.properties) {
        if (property.length) {
            const bool is_kept =
                is_face && (property.name == "vertex_indices" || property.name == "vertex_index");
            if (!read_list(property, is_kept)) return false;
            if (is_kept) builder_.add_polygon(ids_);
            continue;
        }
        double value = 0;
        if (!read_value(property.scalar, value)) return false;
        if (is_vertex && property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
            p[property.name[0] - 'x'] = value;
    }
    if (is_vertex) builder_.soup.vertices.push_back(p);
    return true;
}

bool PlyReader::read_element(const Element& element) {
    const auto has = [&](std::string_view name) {
        return std::any_of(element.properties.begin(), element.properties.end(),
                           [&](const Property& p) { return p.name == name; });
    };
    if (element.count == 0) return true;
    if (element.properties.empty())
        return fail(fmt::format("element {} has no properties", shown(element.name)));
    if (!scanner_.check_count(element.count, "items of an element", least_bytes(element))) return false;
    if (element.name == "vertex" && !(has("x") && has("y") && has("z")))
        return fail("vertices without x, y and z");
    if (element.name == "tristrips")
        return scanner_.fail("triangle strips are not supported", "write the faces one by one");
    for (std::size_t i = 0; i < element.count; ++i)
        if (!read_item(element)) return false;
    return true;
}

bool PlyReader::read() {
    if (!read_header()) return false;
    builder_.patch = builder_.patch_of("surface");
    for (const Element& element : elements_)
        if (!read_element(element)) return false;
    return scanner_.ok();
}

} // namespace

bool looks_like_ply(std::string_view bytes) {
    return bytes.starts_with("ply\n") || bytes.starts_with("ply\r\n");
}

bool read_ply(Scanner& scanner, SurfaceBuilder& builder) { return PlyReader(scanner, builder).read(); }

} // namespace hexopt::io_detail
