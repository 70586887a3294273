import pytest
from soft_block import Block, make_block


@pytest.fixture(scope="session")
def block() -> Block:
    return make_block()
