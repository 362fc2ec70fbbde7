#pragma once

#include "core/result.hpp"
#include "core/types.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hexopt::io_detail {

/// Reads tokens, numbers, lines and raw bytes from a file in memory. The first failure sticks: every later
/// call returns false or nothing, so a reader may check ok() once a block.
class Scanner {
  public:
    /// comment: a character that starts a comment up to the end of the line, or 0.
    Scanner(std::string file, std::string_view bytes, char comment = 0)
        : file_(std::move(file)), bytes_(bytes), comment_(comment) {}

    bool ok() const { return !error_; }
    const Error& error() const { return *error_; }
    const std::string& file() const { return file_; }
    std::string_view bytes() const { return bytes_; }

    std::size_t position() const { return position_; }
    void seek(std::size_t position) { position_ = position < bytes_.size() ? position : bytes_.size(); }
    std::size_t remaining() const { return bytes_.size() - position_; }
    std::size_t line_at(std::size_t position) const; ///< 1-based
    /// "FILE:LINE", or "FILE: byte N" after set_binary().
    std::string place(std::size_t position) const;
    void set_binary() { is_binary_ = true; }
    std::string byte_place(std::size_t position) const { ///< "FILE: byte N"
        return file_ + ": byte " + std::to_string(position);
    }

    /// Records the first failure; always returns false.
    bool fail(std::string reason, std::string advice = {}) { return fail_at(token_start_, reason, advice); }
    bool fail_at(std::size_t position, std::string reason, std::string advice = {});
    bool fail_in(std::string where, std::string reason, std::string advice = {});
    bool adopt(Error error);

    void skip_space();
    bool at_end() { return skip_space(), position_ == bytes_.size(); }

    /// Next run of characters that are not white space; empty at the end or after a failure.
    std::string_view token();
    /// The next token, left in place.
    std::string_view peek();
    /// Rest of the line without its end, which is consumed ("\n" or "\r\n").
    std::string_view line();
    /// Next `count` bytes as they are; fails where fewer are left.
    std::string_view raw(std::size_t count);

    bool read_double(double& value);
    bool read_float(double& value); ///< the nearest float
    bool read_int(std::int64_t& value);
    /// A count of things that need at least bytes_each bytes of what follows, and of vertices or cells at
    /// most kNoIndex - 1.
    bool read_count(std::size_t& count, const char* things, std::size_t bytes_each);
    bool check_count(std::uint64_t count, const char* things, std::size_t bytes_each);

    /// Position of the number'th (0-based) token after `start`.
    std::size_t find_token(std::size_t start, std::size_t number) const;

  private:
    bool fail_token(std::string_view token, const char* expected);

    std::string file_;
    std::string_view bytes_;
    char comment_;
    std::size_t position_ = 0;
    std::size_t token_start_ = 0;
    bool is_binary_ = false;
    std::optional<Error> error_;
};

/// At most 40 characters of a token, without control characters, for messages.
std::string shown(std::string_view token);

/// ASCII letters in lower case.
std::string lower(std::string_view text);

} // namespace hexopt::io_detail
