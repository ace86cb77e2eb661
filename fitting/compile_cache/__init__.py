"""Compiled programs, kept from one process to the next in a folder that only the user can write.

An entry of JAX's compilation cache on a CPU is machine code, so whoever can write the folder can
run code as the user, and an entry of another processor can end the process. The folder is therefore
private, and has one subfolder for each processor and set of versions. Nothing here imports JAX: its
settings are environment variables, which it reads when it is imported. Importing `fitting` sets
none of them; the command line, the processes of the withheld-effect check and the tests do.
"""

from ._damaged import drop_damaged_entries as drop_damaged_entries
from ._entries import Entries as Entries
from ._entries import clear_entries as clear_entries
from ._entries import count_entries as count_entries
from ._entries import drop_oldest as drop_oldest
from ._folder import NotPrivateError as NotPrivateError
from ._folder import cache_root as cache_root
from ._folder import is_machine_folder as is_machine_folder
from ._folder import machine_folder as machine_folder
from ._folder import make_private as make_private
from ._settings import DIRECTORY as DIRECTORY
from ._settings import SWITCH as SWITCH
from ._settings import CacheState as CacheState
from ._settings import cache_state as cache_state
from ._settings import compiled_programs_kept as compiled_programs_kept
from ._settings import switched_off as switched_off
from ._settings import variables as variables
from ._settings import worker_variables as worker_variables
