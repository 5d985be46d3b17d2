open
{
	{
		map a
	}
} /* and no end
