"""What is broken on purpose, by kind, and the short tests that must notice."""

from ._certificates import CERTIFICATES
from ._laws import LAWS
from ._limits import LIMITS
from ._mutation import Mutation as Mutation
from ._readers import READERS
from ._verdicts import VERDICTS

MUTATIONS = (*LAWS, *LIMITS, *CERTIFICATES, *READERS, *VERDICTS)
