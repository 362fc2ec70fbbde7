#include "io/xml_tags.hpp"

#include <charconv>
#include <fmt/format.h>

namespace hexopt::io_detail {

namespace {

constexpr std::string_view kSpace = " \t\r\n";

bool is_name_character(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == ':' || c == '.';
}

std::string_view take_name(std::string_view& text) {
    std::size_t size = 0;
    while (size < text.size() && is_name_character(text[size])) ++size;
    const std::string_view name = text.substr(0, size);
    text.remove_prefix(size);
    return name;
}

void trim_front(std::string_view& text) {
    text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
}

std::string unescaped(std::string_view text) {
    constexpr std::pair<std::string_view, char> kEntities[] = {
        {"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}};
    std::string out;
    while (!text.empty()) {
        std::size_t used = 1;
        char c = text[0];
        for (const auto& [entity, character] : kEntities)
            if (text.starts_with(entity)) c = character, used = entity.size();
        if (text.starts_with("&#")) {
            unsigned code = 0;
            const auto [end, error] = std::from_chars(text.data() + 2, text.data() + text.size(), code);
            if (error == std::errc() && end != text.data() + text.size() && *end == ';' && code < 128) {
                c = static_cast<char>(code);
                used = static_cast<std::size_t>(end + 1 - text.data());
            }
        }
        out += c;
        text.remove_prefix(used);
    }
    return out;
}

/// `text` is what stands between the tag's name and '>'.
bool parse_attributes(std::string_view text, XmlTag& tag) {
    for (trim_front(text); !text.empty(); trim_front(text)) {
        const std::string_view name = take_name(text);
        trim_front(text);
        if (name.empty() || !text.starts_with('=')) return false;
        text.remove_prefix(1);
        trim_front(text);
        if (text.empty() || (text[0] != '"' && text[0] != '\'')) return false;
        const std::size_t end = text.find(text[0], 1);
        if (end == std::string_view::npos) return false;
        tag.attributes.emplace_back(name, unescaped(text.substr(1, end - 1)));
        text.remove_prefix(end + 1);
    }
    return true;
}

/// Position of the '>' that ends a tag, which may not lie within quotes.
std::size_t find_tag_end(std::string_view bytes, std::size_t position) {
    char quote = 0;
    for (; position < bytes.size(); ++position) {
        const char c = bytes[position];
        if (quote != 0) {
            if (c == quote) quote = 0;
        } else if (c == '"' || c == '\'') {
            quote = c;
        } else if (c == '>' || c == '<') {
            return c == '>' ? position : std::string_view::npos;
        }
    }
    return std::string_view::npos;
}

bool skip_past(Scanner& scanner, std::size_t begin, std::string_view mark) {
    const std::size_t end = scanner.bytes().find(mark, begin);
    if (end == std::string_view::npos)
        return scanner.fail_at(begin, "markup without an end", "the file is cut short");
    scanner.seek(end + mark.size());
    return true;
}

} // namespace

const std::string* XmlTag::find(std::string_view attribute) const {
    for (const auto& [key, value] : attributes)
        if (key == attribute) return &value;
    return nullptr;
}

bool next_tag(Scanner& scanner, XmlTag& tag) {
    constexpr const char* kDamaged = "the file is damaged or cut short; write or copy it again";
    const std::string_view bytes = scanner.bytes();
    while (scanner.ok()) {
        const std::size_t begin = bytes.find('<', scanner.position());
        if (begin == std::string_view::npos) return false;
        const std::string_view rest = bytes.substr(begin);
        if (rest.starts_with("<!--")) {
            skip_past(scanner, begin, "-->");
            continue;
        }
        if (rest.starts_with("<?")) {
            skip_past(scanner, begin, "?>");
            continue;
        }
        if (rest.starts_with("<!"))
            return scanner.fail_at(begin, "a declaration that VTU files do not have", "remove it");
        const std::size_t end = find_tag_end(bytes, begin + 1);
        if (end == std::string_view::npos) return scanner.fail_at(begin, "a tag without an end", kDamaged);
        std::string_view inner = bytes.substr(begin + 1, end - begin - 1);
        tag = XmlTag{};
        tag.begin = begin;
        tag.end = end + 1;
        tag.is_end = inner.starts_with('/') || inner.ends_with('/');
        tag.is_start = !inner.starts_with('/');
        if (!tag.is_start) inner.remove_prefix(1);
        if (inner.ends_with('/')) inner.remove_suffix(1);
        tag.name = take_name(inner);
        if (tag.name.empty() || !parse_attributes(inner, tag))
            return scanner.fail_at(begin, fmt::format("a tag that is no XML: {}", shown(rest)), kDamaged);
        scanner.seek(end + 1);
        return true;
    }
    return false;
}

} // namespace hexopt::io_detail
