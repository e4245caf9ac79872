#include "server/jobs/sqlite.h"

#include <sqlite3.h>

#include <cerrno>
#include <system_error>

#include "core/io/file_error.h"
#include "server/errors/errors.h"

namespace shaped::server {
namespace {

constexpr int kBusyMilliseconds = 10'000;

int primary(int code) { return code & 0xff; }

std::string systemReason(sqlite3* handle) {
  if (primary(sqlite3_errcode(handle)) == SQLITE_FULL) return std::generic_category().message(ENOSPC);
  const int error = sqlite3_system_errno(handle);
  if (error != 0) return std::generic_category().message(error);
  // A write that failed half-way has lost its reason: a quota or a size limit (a full disk is SQLITE_FULL), seldom a
  // broken disk.
  if (sqlite3_extended_errcode(handle) == SQLITE_IOERR_WRITE)
    return std::generic_category().message(EFBIG) + ", or the disk is broken";
  return sqlite3_errmsg(handle);
}

}  // namespace

Database::Database(const std::filesystem::path& file) : file_(file.string()) {
  const int code = sqlite3_open_v2(file_.c_str(), &handle_,
                                   SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  try {
    if (code != SQLITE_OK) fail("cannot be opened");
    sqlite3_extended_result_codes(handle_, 1);
    sqlite3_busy_timeout(handle_, kBusyMilliseconds);
    if (sqlite3_db_readonly(handle_, "main") == 1)
      throw FileError(file_, "cannot be written: the file or its file system is read-only");
  } catch (...) {
    close();
    throw;
  }
}

Database::~Database() { close(); }

void Database::close() {
  sqlite3_close_v2(handle_);
  handle_ = nullptr;
}

void Database::run(const std::string& sql) {
  if (sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail("cannot be used");
}

std::int64_t Database::lastRow() const { return sqlite3_last_insert_rowid(handle_); }

void Database::fail(const std::string& problem) const {
  switch (primary(sqlite3_errcode(handle_))) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      throw StoreLocked(file_ + ": is locked by another program; end that one and try again");
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      throw Corrupted(file_ + ": is damaged or no database (" + sqlite3_errmsg(handle_) +
                      "); restore it from a backup, or stop the daemon and move it away together with " + file_ +
                      "-wal and -shm: jobs are forgotten then, datasets and models stay");
    case SQLITE_READONLY:
      throw FileError(file_, "cannot be written: the file or its file system is read-only");
    case SQLITE_FULL:
    case SQLITE_IOERR:
      throw FileError(file_, "cannot be written: " + systemReason(handle_));
    default:
      throw FileError(file_, problem + ": " + systemReason(handle_));
  }
}

Statement::Statement(Database& database, const std::string& sql) : database_(database) {
  require(sqlite3_prepare_v2(database.handle_, sql.c_str(), static_cast<int>(sql.size()), &handle_, nullptr));
}

Statement::~Statement() { sqlite3_finalize(handle_); }

void Statement::require(int code) {
  if (code != SQLITE_OK) database_.fail("cannot be used");
}

void Statement::bind(int parameter, std::int64_t value) { require(sqlite3_bind_int64(handle_, parameter + 1, value)); }
void Statement::bind(int parameter, double value) { require(sqlite3_bind_double(handle_, parameter + 1, value)); }
void Statement::bindNull(int parameter) { require(sqlite3_bind_null(handle_, parameter + 1)); }

void Statement::bindText(int parameter, std::string_view value) {
  require(sqlite3_bind_text64(handle_, parameter + 1, value.data(), value.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
}

void Statement::bindBytes(int parameter, std::string_view value) {
  require(sqlite3_bind_blob64(handle_, parameter + 1, value.data(), value.size(), SQLITE_TRANSIENT));
}

bool Statement::step() {
  const int code = sqlite3_step(handle_);
  if (code != SQLITE_ROW && code != SQLITE_DONE) database_.fail("cannot be used");
  return code == SQLITE_ROW;
}

bool Statement::isNull(int column) const { return sqlite3_column_type(handle_, column) == SQLITE_NULL; }
std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(handle_, column); }
double Statement::real(int column) const { return sqlite3_column_double(handle_, column); }

std::string Statement::bytes(int column) const {
  const auto* data = static_cast<const char*>(sqlite3_column_blob(handle_, column));
  return data ? std::string(data, static_cast<std::size_t>(sqlite3_column_bytes(handle_, column))) : std::string();
}

Transaction::Transaction(Database& database) : database_(database) { database_.run("BEGIN IMMEDIATE"); }

Transaction::~Transaction() {
  if (!open_) return;
  try {
    database_.run("ROLLBACK");
  } catch (const std::exception&) {  // SQLite has rolled back by itself
  }
}

void Transaction::commit() {
  database_.run("COMMIT");
  open_ = false;
}

}  // namespace shaped::server
