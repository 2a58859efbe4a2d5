#pragma once

#include <string>

/// What a program of the command line has of the system: arguments, standard streams, a terminal, and what ends it from
/// outside: Ctrl-C, SIGTERM, a terminal or console that is closed, the end of a session.
namespace splat::os {

/// The arguments of main() in UTF-8, with a null pointer behind them. On Windows `count` becomes theirs, and they last
/// as long as the process.
char** arguments(int& count, char** words);

/// Call it first in a program, not in a library. Standard streams are there and carry bytes as they are, a console
/// shows UTF-8, a closed pipe ends the program, and writing beyond a limit of sizes is an error.
void prepare_program();

/// Standard error is a terminal, which understands the sequences of ECMA-48 ("\033[K").
bool errors_on_terminal();

/// Write to standard error, at once and without locks: a handler of signals may call it.
void write_error(const char* text);

/// Have `asked` called instead, which returns false to end the process at once; and `closed_pipe` when nobody reads
/// what it writes. They are called in a handler of signals, on Windows in a thread of the system: no more than
/// atomics without locks and write_error() is for them. A hang-up that nohup has ignored stays ignored. Windows does
/// not tell of closed pipes, and ends a process five seconds after its console is closed.
void catch_interrupts(bool (*asked)(), void (*closed_pipe)());
/// Interrupts end the process again.
void release_interrupts();

/// Have an interrupt that nobody catches remove a folder before it ends the process. False if it already has another.
bool remove_when_interrupted(const std::string& folder);
void keep_when_interrupted();

}  // namespace splat::os
