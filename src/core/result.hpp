#pragma once

#include <cassert>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace hexopt {

/// Why a call failed. The values are the command line's exit codes (docs/exit-codes.md).
enum class ErrorCode {
    ok = 0,
    usage = 2,
    bad_input = 3,
    output_failed = 4,
    no_valid_mesh = 5,
    device = 6,
    out_of_memory = 7,
    cancelled = 8,
    below_target = 9,
};

/// Short stable name of a code, e.g. "bad_input".
const char* name_of(ErrorCode code);

/// An expected failure: what is wrong, where, and what to do about it.
struct Error {
    ErrorCode code = ErrorCode::bad_input;
    std::string stage;                ///< e.g. "read", "optimize"
    std::string where;                ///< file and line, vertex or cell; may be empty
    std::vector<std::string> reasons; ///< from the general to the particular; the last may say what to do

    /// "stage: where: reason; reason" on one line, without a newline.
    std::string one_line() const;
};

/// A value, or the Error that stands in its place.
template <class T>
class [[nodiscard]] Result {
  public:
    Result(T value) : content_(std::in_place_index<0>, std::move(value)) {}
    Result(Error error) : content_(std::in_place_index<1>, std::move(error)) {}

    bool has_value() const { return content_.index() == 0; }
    explicit operator bool() const { return has_value(); }

    T& value() & { return assert(has_value()), std::get<0>(content_); }
    const T& value() const& { return assert(has_value()), std::get<0>(content_); }
    T&& value() && { return assert(has_value()), std::get<0>(std::move(content_)); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }
    T& operator*() & { return value(); }
    const T& operator*() const& { return value(); }
    T&& operator*() && { return std::move(*this).value(); }

    const Error& error() const { return assert(!has_value()), std::get<1>(content_); }

  private:
    std::variant<T, Error> content_;
};

/// Success without a value.
struct Done {};
using Status = Result<Done>;

inline Error make_error(ErrorCode code, std::string stage, std::string where, std::string reason) {
    return Error{code, std::move(stage), std::move(where), {std::move(reason)}};
}

} // namespace hexopt
