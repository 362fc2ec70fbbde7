#include "io/scanner.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>

namespace hexopt::io_detail {

namespace {

constexpr bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// from_chars reports a value below the smallest normal number as out of range; strtod rounds it.
template <class Real>
bool parse_real(std::string_view text, Real& value) {
    if (text.starts_with('+')) text.remove_prefix(1);
    if (text.empty()) return false;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (end != text.data() + text.size()) return false;
    if (code == std::errc()) return true;
    if (code != std::errc::result_out_of_range) return false;
    const std::string copy(text);
    if constexpr (sizeof(Real) == sizeof(float))
        value = std::strtof(copy.c_str(), nullptr);
    else
        value = std::strtod(copy.c_str(), nullptr);
    return std::isfinite(value);
}

} // namespace

std::string shown(std::string_view token) {
    constexpr std::size_t kMost = 40;
    std::string text(token.substr(0, kMost));
    for (char& c : text)
        if (c < ' ' || c > '~') c = '?';
    return text;
}

std::string lower(std::string_view text) {
    std::string out(text);
    for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return out;
}

std::size_t Scanner::line_at(std::size_t position) const {
    return 1 + static_cast<std::size_t>(std::count(
                   bytes_.begin(),
                   bytes_.begin() + static_cast<std::ptrdiff_t>(std::min(position, bytes_.size())), '\n'));
}

std::string Scanner::place(std::size_t position) const {
    return is_binary_ ? byte_place(position) : fmt::format("{}:{}", file_, line_at(position));
}

bool Scanner::fail_in(std::string where, std::string reason, std::string advice) {
    if (error_) return false;
    error_ = Error{ErrorCode::bad_input, "read", std::move(where), {std::move(reason)}};
    if (!advice.empty()) error_->reasons.push_back(std::move(advice));
    return false;
}

bool Scanner::fail_at(std::size_t position, std::string reason, std::string advice) {
    return error_ ? false : fail_in(place(position), std::move(reason), std::move(advice));
}

bool Scanner::adopt(Error error) {
    if (!error_) error_ = std::move(error);
    return false;
}

void Scanner::skip_space() {
    while (position_ < bytes_.size()) {
        const char c = bytes_[position_];
        if (comment_ != 0 && c == comment_) {
            const std::size_t end = bytes_.find('\n', position_);
            position_ = end == std::string_view::npos ? bytes_.size() : end;
        } else if (is_space(c)) {
            ++position_;
        } else {
            return;
        }
    }
}

std::string_view Scanner::token() {
    if (error_) return {};
    skip_space();
    token_start_ = position_;
    while (position_ < bytes_.size() && !is_space(bytes_[position_])) ++position_;
    return bytes_.substr(token_start_, position_ - token_start_);
}

std::string_view Scanner::peek() {
    const std::size_t position = position_, start = token_start_;
    const std::string_view next = token();
    position_ = position;
    token_start_ = start;
    return next;
}

std::string_view Scanner::line() {
    if (error_) return {};
    token_start_ = position_;
    const std::size_t end = bytes_.find('\n', position_);
    std::string_view text = bytes_.substr(position_, end == std::string_view::npos ? end : end - position_);
    position_ = end == std::string_view::npos ? bytes_.size() : end + 1;
    if (text.ends_with('\r')) text.remove_suffix(1);
    return text;
}

std::string_view Scanner::raw(std::size_t count) {
    if (error_) return {};
    token_start_ = position_;
    if (count > remaining()) {
        fail_in(byte_place(position_),
                fmt::format("needs {} more bytes, but the file ends after {}", count, remaining()),
                "the file is cut short; write or copy it again");
        return {};
    }
    position_ += count;
    return bytes_.substr(token_start_, count);
}

bool Scanner::fail_token(std::string_view token, const char* expected) {
    if (token.empty())
        return fail(fmt::format("the file ends where {} should follow", expected),
                    "it is cut short; write or copy it again");
    return fail(fmt::format("'{}' stands where {} should", shown(token), expected),
                "the file is damaged or a count before this place is wrong");
}

bool Scanner::read_double(double& value) {
    const std::string_view text = token();
    return ok() && (parse_real(text, value) || fail_token(text, "a number"));
}

bool Scanner::read_float(double& value) {
    const std::string_view text = token();
    float nearest = 0;
    if (!ok() || !(parse_real(text, nearest) || fail_token(text, "a number"))) return false;
    value = nearest;
    return true;
}

bool Scanner::read_int(std::int64_t& value) {
    std::string_view text = token();
    if (error_) return false;
    if (text.starts_with('+')) text.remove_prefix(1);
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (code == std::errc() && end == text.data() + text.size() && !text.empty()) return true;
    return fail_token(text, "a whole number");
}

bool Scanner::check_count(std::uint64_t count, const char* things, std::size_t bytes_each) {
    if (error_) return false;
    // The last number of a text may stand without a separator, hence the one byte more.
    if (bytes_each > 0 && count > (remaining() + 1) / bytes_each)
        return fail(fmt::format("announces {} {}, but only {} bytes follow", count, things, remaining()),
                    "the file is cut short or damaged; write or copy it again");
    if (count >= kNoIndex)
        return fail(
            fmt::format("{} {} are more than the {} that a mesh may have", count, things, kNoIndex - 1),
            "split the mesh");
    return true;
}

bool Scanner::read_count(std::size_t& count, const char* things, std::size_t bytes_each) {
    std::int64_t value = 0;
    if (!read_int(value)) return false;
    if (value < 0) return fail(fmt::format("a count of {} {}", value, things), "the file is damaged");
    count = static_cast<std::size_t>(value);
    return check_count(count, things, bytes_each);
}

std::size_t Scanner::find_token(std::size_t start, std::size_t number) const {
    Scanner scanner(file_, bytes_, comment_);
    scanner.seek(start);
    for (std::size_t i = 0; i <= number; ++i)
        if (scanner.token().empty()) break;
    return scanner.token_start_;
}

} // namespace hexopt::io_detail
