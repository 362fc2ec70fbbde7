#include "io/cad_format.hpp"
#include "io/scanner.hpp"

#include <array>
#include <charconv>
#include <cstdint>
#include <fmt/format.h>
#include <vector>

namespace hexopt::io_detail {

namespace {

constexpr std::string_view kSections = "SGDPT";
constexpr std::size_t kSectionColumn = 72; ///< 0-based; columns 73 to 80 hold section and number
constexpr std::size_t kDataColumns = 64;   ///< of a parameter line; its entity's number follows
constexpr const char* kDamaged = "the file is damaged or cut short; write or copy it again";

/// Which parameters (1: the first after the entity's number) of an entity say how many others follow.
struct CountedEntity {
    int number;
    std::array<int, 2> at;
    bool is_product; ///< the counts are of a grid
};
constexpr CountedEntity kCounted[] = {
    {102, {1, 0}, false}, {106, {2, 0}, false}, {112, {4, 0}, false}, {114, {3, 4}, true},
    {126, {1, 2}, false}, {128, {1, 2}, true},  {128, {3, 4}, false}, {141, {4, 0}, false},
    {143, {3, 0}, false}, {144, {3, 0}, false}, {184, {1, 0}, false}, {186, {3, 0}, false},
    {402, {1, 0}, false}, {502, {1, 0}, false}, {504, {1, 0}, false}, {508, {1, 0}, false},
    {510, {2, 0}, false}, {514, {1, 0}, false},
};

bool to_int(std::string_view text, std::int64_t& value) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    if (text.empty()) return value = 0, true; // a default
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
}

class IgesWalk {
  public:
    IgesWalk(const std::string& file, std::string_view bytes) : scanner_(file, bytes) {}

    bool whole() {
        while (scanner_.remaining() > 0 && lines_[4] == 0) {
            const std::size_t start = scanner_.position();
            const std::string_view line = scanner_.line();
            if (line.empty()) continue;
            if (!take(line, start)) return false;
        }
        if (lines_[4] == 0)
            return fail(scanner_.position(), "an IGES file without its last line (section T)");
        return check_totals() && check_record(record_start_);
    }
    const Error& error() const { return scanner_.error(); }

  private:
    bool fail(std::size_t position, std::string reason) {
        return scanner_.fail_at(position, std::move(reason), kDamaged);
    }

    bool take(std::string_view line, std::size_t start) {
        if (line.size() < 80) return fail(start, fmt::format("a line of {} columns, not 80", line.size()));
        const std::size_t section = kSections.find(line[kSectionColumn]);
        if (section == std::string_view::npos || section < section_ || section > section_ + 1)
            return fail(start, fmt::format("section \"{}\" in column 73", shown(line.substr(72, 1))));
        section_ = section;
        std::int64_t number = 0;
        if (!to_int(line.substr(73, 7), number) || number != static_cast<std::int64_t>(++lines_[section]))
            return fail(start, fmt::format("line \"{}\" of section {}, not {}", shown(line.substr(73, 7)),
                                           kSections[section], lines_[section]));
        if (section == 1) global_ += line.substr(0, kSectionColumn);
        if (section == 3) return parameters(line, start);
        if (section == 4) totals_ = line;
        return true;
    }

    /// The parameter and the record delimiter: the first two values of section G.
    void find_delimiters() {
        std::string_view rest = global_;
        if (rest.starts_with("1H") && rest.size() > 4) {
            delimiter_ = rest[2];
            rest.remove_prefix(4);
        } else {
            rest.remove_prefix(std::min<std::size_t>(1, rest.size()));
        }
        if (rest.starts_with("1H") && rest.size() > 2) end_ = rest[2];
    }

    bool parameters(std::string_view line, std::size_t start) {
        if (lines_[3] == 1) find_delimiters();
        const std::string_view entity = line.substr(kDataColumns, kSectionColumn - kDataColumns);
        if (entity != entity_) {
            if (!check_record(record_start_)) return false;
            entity_ = entity;
            record_.clear();
            record_start_ = start;
        }
        record_ += line.substr(0, kDataColumns);
        return true;
    }

    /// Counts of an entity against the number of its parameters. Delimiters inside text only raise that
    /// number.
    bool check_record(std::size_t start) {
        std::int64_t size = 1;
        for (char c : record_) size += c == delimiter_ || c == end_;
        std::array<std::int64_t, 5> value{};
        std::array<bool, 5> is_number{};
        std::string_view rest = record_;
        for (std::size_t i = 0; i < value.size() && !rest.empty(); ++i) {
            const std::size_t stop = rest.find_first_of(std::array{delimiter_, end_, '\0'}.data());
            is_number[i] = to_int(rest.substr(0, stop), value[i]);
            rest.remove_prefix(stop == std::string_view::npos ? rest.size() : stop + 1);
        }
        for (const CountedEntity& counted : kCounted) {
            if (!is_number[0] || counted.number != value[0]) continue;
            std::int64_t product = 1;
            for (int at : counted.at) {
                if (at == 0) continue;
                const auto k = static_cast<std::size_t>(at);
                if (!is_number[k] || value[k] < 0 || value[k] > size)
                    return fail(start,
                                fmt::format("entity {} with a count that its {} parameters cannot hold",
                                            counted.number, size));
                product *= value[k] + 1;
            }
            if (counted.is_product && product > size)
                return fail(start, fmt::format("entity {} with {} points in {} parameters", counted.number,
                                               product, size));
        }
        return true;
    }

    /// "S      1G      4D     22P     11": the number of lines of each section.
    bool check_totals() {
        for (std::size_t s = 0; s < 4; ++s) {
            const std::string_view field = totals_.substr(8 * s, 8);
            std::int64_t number = 0;
            if (field[0] != kSections[s] || !to_int(field.substr(1), number) ||
                number != static_cast<std::int64_t>(lines_[s]))
                return fail(scanner_.position(),
                            fmt::format("{} lines in section {}, where the last line says {}", lines_[s],
                                        kSections[s], shown(field)));
        }
        return true;
    }

    Scanner scanner_;
    std::size_t section_ = 0;
    std::array<std::size_t, 5> lines_{};
    std::string global_, entity_, record_;
    std::size_t record_start_ = 0;
    std::string_view totals_;
    char delimiter_ = ',', end_ = ';';
};

} // namespace

bool looks_like_iges(std::string_view bytes) {
    return bytes.size() > 81 && bytes[kSectionColumn] == 'S' &&
           bytes.substr(0, 80).find('\n') == std::string_view::npos &&
           bytes.substr(73, 7).find_first_not_of(" 01") == std::string_view::npos && bytes[79] == '1';
}

Status check_iges(const std::string& file, std::string_view bytes) {
    if (!looks_like_iges(bytes))
        return Error{
            ErrorCode::bad_input,
            "read",
            file,
            {"no IGES file: no S in column 73 of its first line", "give an IGES file in fixed form (text)"}};
    IgesWalk walk(file, bytes);
    if (!walk.whole()) return walk.error();
    return Done{};
}

} // namespace hexopt::io_detail
